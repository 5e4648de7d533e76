#!/usr/bin/env bash
# Ends with 0 where no library that a program loads is known for code under the GPL, and with 1 and the
# names of such libraries where there are some, or where a library is not found.
#
#   cluster/no_gpl.sh PROGRAM        the libraries that it is linked with, and theirs, by ldd
#   cluster/no_gpl.sh --running PID  those that a process has loaded, plug-ins of MPI among them
#   cluster/no_gpl.sh --list …       says the names of all libraries as well
set -euo pipefail

# FFTW, SuiteSparse (UMFPACK, SPQR, CHOLMOD), GSL, GLPK and readline are under the GPL. Debian's copyright
# files name files under the GPL in CombBLAS and in Trilinos, of which ML is a part; ParMETIS may not be
# passed on.
names='fftw|umfpack|spqr|cholmod|gsl|glpk|readline|trilinos|ml[._]|combblas|parmetis'

fail() { echo "no_gpl: $*" >&2; exit 1; }

is_listed=''
[ "${1:-}" != --list ] || { is_listed=1; shift; }
case "$#:${1:-}" in
    2:--running)
        what="process $2"
        libraries="$(sed -n 's|.*/\([^/]*\.so[^/]*\)$|\1|p' "/proc/$2/maps" | sort -u)" ;;
    1:*)
        what="$1"
        [ -f "$1" ] || fail "there is no file $1"
        found="$(ldd "$1" 2>&1)" || fail "ldd says of $1: $found"
        ! missing="$(grep 'not found' <<<"$found")" || fail "not found for $1: $missing"
        libraries="$(sed -n 's|^\s*\([^ ]*\.so[^ ]*\) .*|\1|p' <<<"$found" | sed 's|.*/||' | sort -u)" ;;
    *)
        echo "usage: cluster/no_gpl.sh [--list] PROGRAM | --running PID" >&2
        exit 2 ;;
esac
[ -n "$libraries" ] || fail "$what has no shared libraries"
[ -z "$is_listed" ] || echo "$libraries"
bad="$(grep -iE "^lib($names)" <<<"$libraries" || true)"
[ -z "$bad" ] || fail "$what must not be given away with $(paste -sd ' ' <<<"$bad") (code under the GPL)"
echo "no_gpl: $what loads $(wc -l <<<"$libraries") libraries, none of them known for code under the GPL"
