# RTC_SANITIZE=address,undefined | thread instruments everything that follows; RTC_FUZZ adds coverage for libFuzzer.
set(RTC_SANITIZE "" CACHE STRING "Sanitizers, comma separated: address,undefined or thread")
option(RTC_FUZZ "Instrument for libFuzzer (clang) and build the fuzz targets" OFF)

if(RTC_SANITIZE)
  add_compile_options(-fsanitize=${RTC_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${RTC_SANITIZE})
  if(RTC_SANITIZE MATCHES "undefined")
    # A finding must fail the test that made it.
    add_compile_options(-fno-sanitize-recover=undefined)
    add_link_options(-fno-sanitize-recover=undefined)
  endif()
endif()
if(RTC_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    message(FATAL_ERROR "RTC_FUZZ needs clang: configure with --preset fuzz")
  endif()
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
