# What `cmake --install` and the package contain. In a prefix other than /usr the files for the system (udev, limits) are left
# to the reader: `upright doctor --fix` prints them.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
option(UPRIGHT_PACKAGE "Install what a package of the system has too: udev rule, limits, copyright" OFF)

# The program, and the texts that it writes about itself.
install(TARGETS upright RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY config examples DESTINATION ${CMAKE_INSTALL_DATADIR}/upright)
# The engines are compiled for a fixed list of effects: who adds one builds from this (examples/own-effect).
install(DIRECTORY src sim hal studies include cmake packaging config examples
        DESTINATION ${CMAKE_INSTALL_DATADIR}/upright/source USE_SOURCE_PERMISSIONS)
install(FILES CMakeLists.txt CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/upright/source)

set(texts ${PROJECT_BINARY_DIR}/texts)
set(completions bash/upright zsh/_upright fish/upright.fish)
set(completion_commands)
foreach(completion IN LISTS completions)
  cmake_path(GET completion PARENT_PATH shell)
  list(APPEND completion_commands COMMAND ${CMAKE_COMMAND} -E make_directory ${texts}/${shell}
       COMMAND upright completion ${shell} > ${texts}/${completion})
endforeach()
add_custom_command(OUTPUT ${texts}/written
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${texts}
  COMMAND upright manual --out ${texts}/man1
  ${completion_commands}
  COMMAND ${CMAKE_COMMAND} -E touch ${texts}/written
  DEPENDS upright)
add_custom_target(installed_texts ALL DEPENDS ${texts}/written)
install(DIRECTORY ${texts}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR})
install(FILES ${texts}/bash/upright DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${texts}/zsh/_upright DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${texts}/fish/upright.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)

# The libraries. The first six are what users link (docs/reference/library.md); they need the others.
set(supported model control hal sim runtime diagnosis)
foreach(name IN LISTS supported ITEMS base loop record design experiment measurement estimation)
  set_target_properties(upright_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS upright_${name} EXPORT upright ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
endforeach()
# The libraries are compiled for these alignments (cmake/options.cmake); what is linked to them has to agree.
target_compile_definitions(upright_model INTERFACE $<INSTALL_INTERFACE:EIGEN_MAX_ALIGN_BYTES=64>
                           $<INSTALL_INTERFACE:EIGEN_MAX_STATIC_ALIGN_BYTES=64>)
target_compile_features(upright_base INTERFACE cxx_std_20)
set(library_folder ${CMAKE_INSTALL_LIBDIR}/cmake/upright)
install(EXPORT upright NAMESPACE upright:: FILE upright-targets.cmake DESTINATION ${library_folder})
install(DIRECTORY include/upright DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
set(upright_source ${CMAKE_INSTALL_DATADIR}/upright/source)
configure_package_config_file(cmake/upright-config.cmake.in ${PROJECT_BINARY_DIR}/upright-config.cmake
                              INSTALL_DESTINATION ${library_folder} PATH_VARS upright_source)
# Before version 1 a minor version may change the API.
write_basic_package_version_file(${PROJECT_BINARY_DIR}/upright-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/upright-config.cmake ${PROJECT_BINARY_DIR}/upright-config-version.cmake
        DESTINATION ${library_folder})

if(UPRIGHT_PACKAGE)
  include(cmake/package.cmake)
endif()
