#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# What takes too long for .ci/run: tests/full.sh. Run it, after .ci/run, before a release or before
# something large is called done. The package's step needs root.
set -euo pipefail
. "$(dirname "$0")/steps.sh"
install_packages doxygen gcovr mmdebstrap

make_package() {
    rm -f build/package/*.deb
    cmake --workflow --preset package >build/package.log || {
        tail -30 build/package.log
        return 1
    }
}

make_pages() {
    mkdir -p build/doc
    doxygen docs/Doxyfile
}

# How many lines of the library and the tools the tests run, by file. No limit is held.
report_coverage() {
    find build/coverage -name '*.gcda' -delete
    VOLCOMP_OPEN_BUILD=1 run_tests coverage -LE slow -E own_folder
    gcovr --root . --object-directory build/coverage --filter libvolcomp --filter tools \
        --exclude-throw-branches --sort-percentage --gcov-ignore-parse-errors \
        --output build/coverage.txt
    tail -3 build/coverage.txt
    say "build/coverage.txt has the lines by file"
}

step "dev: build" build dev
step "clang: build" build clang
step "clang: quick tests" run_tests clang -L quick
step "asan: build" build asan
step "asan: slow tests" run_tests asan -L slow
step "shared library: build" build shared programs man \
    image_test light_test block_source_test half_floats_test vdb_io_test
step "shared library: tests" run_tests shared -R '^(install|volume|view)\.'
step "pages of the library" make_pages
step "package: build" make_package
step "package: install and use" tests/package.sh build/package/*.deb
step "coverage: build" build coverage
step "coverage: quick tests" report_coverage
finish
