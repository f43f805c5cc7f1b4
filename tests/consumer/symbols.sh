#!/bin/sh
# symbols.sh LIBRARY: the runtime exports rtr* only and asks nothing of its host but plain C.
set -eu
case $1 in
  *.a)
    # A static library's internal symbols may be visible to its own objects; they must be hidden or named rtr*.
    exported=$(nm -g --defined-only "$1" | awk 'NF == 3 && $2 != "U" {print $3}' | sort -u)
    undefined=$(nm -u "$1" | awk '$1 == "U" {print $2}' | sort -u)
    undefined=$(printf '%s\n' "$exported" "$exported" "$undefined" | sort | uniq -u)
    ;;
  *)
    exported=$(nm -D --defined-only "$1" | awk '{print $3}' | sort -u)
    undefined=$(nm -D -u "$1" | awk '$1 == "U" {print $2}' | sed 's/@.*//' | sort -u)
    ;;
esac
status=0
for symbol in $exported; do
  case $symbol in rtr*) ;; *) echo "exported: $symbol"; status=1 ;; esac
done
# C11's library, as gcc spells it (fortified and versioned names included), and the compiler's own helpers.
for symbol in $undefined; do
  case $symbol in
    malloc|calloc|realloc|free|aligned_alloc|abort) ;;
    mem*|str*|__mem*_chk|__str*_chk) ;;
    *snprintf*|*printf_chk|qsort|bsearch) ;;
    sqrt*|floor*|ceil*|fabs*|fmin*|fmax*|ldexp*|frexp*|nextafter*|round*|trunc*|log2*|exp2*|pow*) ;;
    __stack_chk_fail|_GLOBAL_OFFSET_TABLE_|__assert_fail|__tls_get_addr) ;;
    *) echo "needs from its host: $symbol"; status=1 ;;
  esac
done
[ $status = 0 ] && echo "$(printf '%s\n' "$exported" | wc -l) symbols exported, all rtr*; needs only the C library"
exit $status
