#!/bin/sh
# pkg_config.sh PROJECT PREFIX BUILD: the same with nothing but a C compiler and pkg-config.
set -eu
rm -rf "$3"
mkdir -p "$3"
PKG_CONFIG_PATH=$(dirname "$(find "$2" -name rtc-runtime.pc)")
export PKG_CONFIG_PATH
# shellcheck disable=SC2046
cc -std=c11 -Wall -Wextra -Werror -pedantic "$1/main.c" -o "$3/consumer" \
  $(pkg-config --define-prefix --cflags --libs rtc-compiler rtc-runtime)
LD_LIBRARY_PATH=$(pkg-config --define-prefix --variable=libdir rtc-compiler) "$3/consumer"
