#!/usr/bin/env bash
# Publishes the committed state in the registry of fpm: ./bootstrap bash packaging/fpm.sh --token TOKEN
# With --dry-run in addition, nothing is uploaded.
#
# The registry refuses packages that depend on git addresses, as the tests depend on test-drive. It also requires that the names of
# all modules begin with the name of the package, which those of the examples do not. The published package therefore contains the
# library and the program only.

set -eu
cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.."
temporary=$(mktemp -d)
trap 'rm -rf "$temporary"' EXIT
git archive HEAD LICENSE README.md app fpm.toml include src | tar -x -C "$temporary"
cd "$temporary"
awk -v RS= -v ORS='\n\n' '!/^\[dev-dependencies\]/ && !/^\[\[(test|example)\]\]/' fpm.toml |
  sed 's/^auto-tests = false$/&\nmodule-naming = "gestell"/' >published.toml
mv published.toml fpm.toml
git init -q && git add -A && git -c user.name=publish -c user.email=publish@localhost commit -q -m 'Publish'
# fpm 0.12 uploads a description of the package, which it expects to be there.
fpm build --list --dump fpm_model.json >/dev/null 2>&1
fpm publish "$@"
