#!/usr/bin/env bash
# Builds PETSc into a folder for a fea-worker that is given away: without the parts under the GPL that
# Debian's has (FFTW, UMFPACK, SPQR, CHOLMOD, ML). Then, with PKG_CONFIG_PATH=FOLDER/lib/pkgconfig,
# `cargo build -p fea-worker` links it.
#
#   cluster/petsc.sh FOLDER
#   MAKE_JOBS=2 cluster/petsc.sh FOLDER          so many compilers at once (else one for each core)
#   SOURCES=DIRECTORY cluster/petsc.sh FOLDER    takes the two archives from there where it has them
#
# It needs, of Debian 12: curl gcc g++ gfortran make pkg-config python3 libopenmpi-dev openmpi-bin
# libopenblas-dev libscalapack-openmpi-dev libmumps-dev.
set -euo pipefail

if [ "$#" != 1 ]; then
    echo "usage: cluster/petsc.sh FOLDER" >&2
    exit 2
fi
mkdir -p "$1"
folder="$(cd "$1" && pwd)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT

# source_of ADDRESS SHA256: fetches an archive; `archive` is where it lies.
source_of() {
    archive="${SOURCES:-$work}/${1##*/}"
    [ -e "$archive" ] ||
        curl --fail --silent --show-error --location --retry 3 --output "$archive" "$1"
    echo "$2  $archive" | sha256sum --check --quiet
}

# Debian's libhypre needs SuperLU_DIST, and that libCombBLAS, which has files under the GPL in its source:
# so hypre is built here too, without it; of Debian 13, because PETSc needs a later one than 2.26.
source_of http://deb.debian.org/debian/pool/main/h/hypre/hypre_2.32.0.orig.tar.gz \
    2277b6f01de4a7d0b01cfe12615255d9640eaa02268565a7ce1a769beab25fa1
hypre="$archive"
source_of https://files.pythonhosted.org/packages/df/0f/0a3ae83f60fba9357e8de2acef74fc0871078c9991ae8aac4d04df118030/petsc-3.26.1.tar.gz \
    a4dc46c1b4403545ac2274741ce10801366c4a9a7b2683b678d18f6663b93496
mkdir "$work/petsc"
tar -xf "$archive" -C "$work/petsc" --strip-components 1
cd "$work/petsc"

options=(
    --prefix="$folder" --with-make-np="${MAKE_JOBS:-$(nproc)}"
    --with-debugging=0 COPTFLAGS=-O2 CXXOPTFLAGS=-O2 FOPTFLAGS=-O2
    --with-shared-libraries=1 --with-scalar-type=real --with-precision=double --with-64-bit-indices=0
    # MUMPS is in Fortran; nothing calls PETSc from there.
    --with-fortran-bindings=0
    --with-fftw=0 --with-suitesparse=0 --with-ml=0 --with-x=0
    --with-mpi=1 --with-blaslapack-lib='-llapack -lblas' --with-scalapack-lib=-lscalapack-openmpi
    --with-mumps-include=/usr/include
    --with-mumps-lib='-ldmumps -lzmumps -lsmumps -lcmumps -lmumps_common'
    --download-hypre="$hypre"
)
# Those of another PETSc would lead it there.
unset PETSC_DIR PETSC_ARCH
here=(PETSC_DIR="$PWD" PETSC_ARCH=softgrasp)
./configure PETSC_ARCH=softgrasp "${options[@]}"
make "${here[@]}" all
make "${here[@]}" install
# Both licences ask that their text goes with the libraries.
mkdir -p "$folder/share/doc/petsc" "$folder/share/doc/hypre"
cp LICENSE "$folder/share/doc/petsc/"
tar -xf "$hypre" -C "$folder/share/doc/hypre" --strip-components 1 --wildcards \
    '*/COPYRIGHT' '*/LICENSE-APACHE' '*/LICENSE-MIT'
