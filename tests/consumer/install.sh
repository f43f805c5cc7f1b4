#!/bin/sh
# install.sh BUILD PREFIX CMAKE: installs the package into an empty prefix.
set -eu
rm -rf "$2"
"$3" --install "$1" --prefix "$2" >/dev/null
find "$2" -type f | sed "s|^$2/||" | sort
