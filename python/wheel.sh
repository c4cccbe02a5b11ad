#!/usr/bin/env bash
# An archive of the sources, and a wheel of them with all that it needs but numpy, in a folder: bash python/wheel.sh [FOLDER]
# Needs gfortran, LAPACK, cmake and Python; the tools of Python's own come into an environment of their own.

set -eu
home=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd)
folder=${1:-dist}
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
python3 -m venv "$temporary/tools"
export PATH=$temporary/tools/bin:$PATH
python -m pip -q install --require-hashes --only-binary :all: -r "$home/.ci/pinned/wheel.txt"
# the wheel is made from the archive, with the tools above
python -m build --no-isolation --outdir "$temporary/plain" "$home"
# bundles gfortran's library, OpenMP's, LAPACK and BLAS
auditwheel repair "$temporary"/plain/gestell-*.whl --wheel-dir "$folder"
cp "$temporary"/plain/gestell-*.tar.gz "$folder"
