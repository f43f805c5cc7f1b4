# `cmake --install`: headers, libraries, programs; find_package(rtc) with components compiler and runtime (targets
# rtc::compiler, rtc::runtime, rtc::runtime_shared), and pkg-config files rtc-compiler and rtc-runtime.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(RTC_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/rtc)
set(RTC_INSTALLED "")

# Joins the two components; of use only where both are installed.
install(FILES ${PROJECT_SOURCE_DIR}/include/rtc/runtime_compiler.h
  COMPONENT runtime DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rtc)

# One component: its header, its libraries as exported targets, its pkg-config file (which names `library`).
# The first target is rtc::<component>; others keep their own EXPORT_NAME.
function(rtc_install_component component library description)
  list(GET ARGN 0 first)
  set_target_properties(${first} PROPERTIES EXPORT_NAME ${component})
  foreach(target ${ARGN})
    target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    install(TARGETS ${target} EXPORT rtc-${component}
      ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${component}
      LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${component}
      RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${component})
  endforeach()
  install(EXPORT rtc-${component} NAMESPACE rtc:: FILE rtc-${component}-targets.cmake
    COMPONENT ${component} DESTINATION ${RTC_PACKAGE_DIR})
  install(FILES ${PROJECT_SOURCE_DIR}/include/rtc/${component}.h ${PROJECT_SOURCE_DIR}/include/rtc/abi.h
    COMPONENT ${component} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rtc)

  set(PC_NAME rtc-${component})
  set(PC_DESCRIPTION "${description}")
  set(PC_LIB ${library})
  configure_file(${PROJECT_SOURCE_DIR}/cmake/rtc.pc.in ${PROJECT_BINARY_DIR}/rtc-${component}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/rtc-${component}.pc
    COMPONENT ${component} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endfunction()

if(TARGET rtcc)
  # For the shaders that are compiled: #include "rtc/spawn.glsl".
  install(FILES ${PROJECT_SOURCE_DIR}/include/rtc/spawn.glsl
    COMPONENT compiler DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/rtc)
  rtc_install_component(compiler rtcc "Links ray tracing shaders into one Vulkan compute shader" rtcc)
  list(APPEND RTC_INSTALLED compiler)
endif()
if(TARGET rtc_runtime)
  rtc_install_component(runtime rtc_runtime "VK_NV_ray_tracing's host side on plain Vulkan compute"
    rtc_runtime rtc_runtime_shared)
  list(APPEND RTC_INSTALLED runtime)
endif()

foreach(program rtc rtc-info rtc-render rtc-run)
  if(TARGET ${program})
    install(TARGETS ${program} COMPONENT programs RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endforeach()

if(RTC_INSTALLED)
  configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/rtc-config.cmake.in ${PROJECT_BINARY_DIR}/rtc-config.cmake
    INSTALL_DESTINATION ${RTC_PACKAGE_DIR} PATH_VARS CMAKE_INSTALL_BINDIR NO_SET_AND_CHECK_MACRO)
  # Before 1.0 a minor version may change what a caller sees.
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/rtc-config-version.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/rtc-config.cmake ${PROJECT_BINARY_DIR}/rtc-config-version.cmake
    DESTINATION ${RTC_PACKAGE_DIR})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md
    DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL)
endif()
