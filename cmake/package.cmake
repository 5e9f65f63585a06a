# `cpack` in the build folder: upright_<version>_amd64.deb. scripts/package.sh builds and tests it.
set(packaging ${PROJECT_SOURCE_DIR}/packaging)
install(FILES ${packaging}/upright-limits.conf DESTINATION /etc/security/limits.d RENAME upright.conf)
install(FILES ${packaging}/60-upright.rules DESTINATION /usr/lib/udev/rules.d)
install(FILES ${packaging}/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
set(CPACK_PACKAGE_CONTACT "The upright developers <upright@lists.invalid>")
# Debian's changelog names the version and its date: that of CHANGELOG.md.
file(STRINGS CHANGELOG.md release REGEX "^## \\[${PROJECT_VERSION}\\] - ")
string(REGEX MATCH "[0-9]+-[0-9]+-[0-9]+" release "${release}")
execute_process(COMMAND date --utc --rfc-email "--date=${release}" OUTPUT_VARIABLE release_date
                OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
configure_file(${packaging}/changelog.in ${PROJECT_BINARY_DIR}/packaging/changelog @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/packaging/changelog CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
# Debian wants changelogs and manual pages compressed; without a time in them each build has the same bytes.
install(CODE "
  set(root \"\$ENV{DESTDIR}\")
  file(GLOB pages \"\${root}${CMAKE_INSTALL_FULL_MANDIR}/man1/*.1\")
  execute_process(COMMAND gzip --best --no-name --force \"\${root}${CMAKE_INSTALL_FULL_DOCDIR}/changelog\"
                  \"\${root}${CMAKE_INSTALL_FULL_DOCDIR}/CHANGELOG.md\" \${pages} COMMAND_ERROR_IS_FATAL ANY)")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME upright)
set(CPACK_PACKAGE_VENDOR "The upright developers")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX ${CMAKE_INSTALL_PREFIX})
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # the libraries of the program
set(CPACK_DEBIAN_PACKAGE_DEPENDS adduser)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS gnuplot-nox)  # draws the plots of reports
# What find_package(upright) looks for: for those who link the libraries only.
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "g++, cmake, pkg-config, libeigen3-dev, libyaml-cpp-dev, libsundials-dev, \
libmodbus-dev, libcomedi-dev, libgpiod-dev, libboost-dev, libnlopt-cxx-dev, nlohmann-json3-dev")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${packaging}/postinst ${packaging}/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_PACKAGE_DESCRIPTION "It balances an inverted pendulum on a cart, such as the Quanser IP02. It is
connected to the rig by Modbus, a Comedi or Quanser card, or GPIO lines, and
it can simulate the rig. From one description of the physics it also designs
controllers, computes how much delay they tolerate, and finds out which
physical effect a model lacks. Libraries and headers are included:
find_package(upright) in CMake.")
include(CPack)
