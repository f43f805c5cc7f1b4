#!/bin/sh
# other_compiler.sh clang|mingw SOURCE BUILD CMAKE: builds the runtime alone, warnings as errors.
set -eu
case $1 in
  clang) compiler=clang; how=-DCMAKE_C_COMPILER=clang ;;
  mingw) compiler=x86_64-w64-mingw32-gcc; how=--toolchain=$2/cmake/mingw-w64.cmake ;;
esac
if ! command -v "$compiler" >/dev/null; then
  echo "SKIP: $compiler is not installed"
  exit 77
fi
rm -rf "$3"
"$4" -S "$2" -B "$3" -G Ninja "$how" -DCMAKE_BUILD_TYPE=Debug -DRTC_WARNINGS_AS_ERRORS=ON \
  -DRTC_BUILD_COMPILER=OFF -DRTC_BUILD_TOOLS=OFF -DRTC_BUILD_TESTS=OFF
"$4" --build "$3" --target rtc_runtime rtc_runtime_shared
