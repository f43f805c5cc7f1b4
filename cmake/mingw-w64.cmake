# Toolchain: 64-bit Windows with Debian's gcc-mingw-w64-x86-64. Only the runtime is built with it:
#   cmake -S . -B build/mingw --toolchain cmake/mingw-w64.cmake -DRTC_BUILD_COMPILER=OFF -DRTC_BUILD_TOOLS=OFF -DRTC_BUILD_TESTS=OFF
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
