# UPRIGHT_FIRMWARE_TESTS: whether what compiles and executes the firmware of a board is here. It is needed for tests only.
set(UPRIGHT_FIRMWARE_TESTS OFF)
find_program(AVR_GCC avr-gcc)
find_library(SIMAVR_LIBRARY simavr)  # its pkg-config file asks for a development package that nobody needs
find_path(SIMAVR_INCLUDE_DIR simavr/sim_avr.h)
if(AVR_GCC AND SIMAVR_LIBRARY AND SIMAVR_INCLUDE_DIR)
  execute_process(COMMAND ${AVR_GCC} -mmcu=atmega328p -include avr/io.h -E -x c /dev/null RESULT_VARIABLE without_avr_libc
                  OUTPUT_QUIET ERROR_QUIET)
  if(without_avr_libc EQUAL 0)
    set(UPRIGHT_FIRMWARE_TESTS ON)
  endif()
endif()
if(NOT UPRIGHT_FIRMWARE_TESTS)
  message(STATUS "the tests of the firmware are left out: gcc-avr, avr-libc or libsimavr-dev is missing "
                 "(scripts/install-deps.sh --dev installs them)")
endif()
