#!/bin/sh
# make.sh PROJECT PREFIX BUILD PROGRAM [ARGUMENT...]: the same through the project's Makefile and pkg-config.
set -eu
project=$1 prefix=$2 build=$3 program=$4
shift 4
if ! command -v make >/dev/null; then
  echo "SKIP: make is not installed"
  exit 77
fi
rm -rf "$build"
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name rtc-runtime.pc)")
export PKG_CONFIG_PATH
make -C "$project" BUILD="$build"
LD_LIBRARY_PATH=$(pkg-config --define-prefix --variable=libdir rtc-runtime) "$build/$program" "$@"
