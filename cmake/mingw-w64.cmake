# Toolchain: 64-bit Windows with Debian's gcc-mingw-w64-x86-64. Only the runtime is built with it:
#   cmake -S . -B build/mingw --toolchain cmake/mingw-w64.cmake -DRTC_BUILD_COMPILER=OFF -DRTC_BUILD_TOOLS=OFF -DRTC_BUILD_TESTS=OFF
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

# Vulkan's headers are the same for every platform, but the host's /usr/include must not come along with them.
find_path(RTC_HOST_VULKAN vulkan/vulkan_core.h PATHS /usr/include NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH REQUIRED)
set(RTR_VULKAN_HEADERS ${CMAKE_BINARY_DIR}/vulkan-headers CACHE PATH "Where vulkan/vulkan_core.h is")
file(MAKE_DIRECTORY ${RTR_VULKAN_HEADERS})
foreach(folder vulkan vk_video)
  if(NOT EXISTS ${RTR_VULKAN_HEADERS}/${folder})
    file(CREATE_LINK ${RTC_HOST_VULKAN}/${folder} ${RTR_VULKAN_HEADERS}/${folder} SYMBOLIC)
  endif()
endforeach()
