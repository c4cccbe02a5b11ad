"""Recipe for Spack. A release needs a line version("1.0.0", sha256=...) with the address of its archive in `url`.

From a checkout: spack repo create gestell-repo, copy this file to gestell-repo/packages/gestell, spack dev-build gestell@main
"""

from spack.package import *


class Gestell(CMakePackage):
    """Vibrations and stability of elastically mounted machine frames: natural frequencies, forces on the ground, vibration at any
    point and Floquet stability, with bounds on the numerical errors."""

    license("MIT")

    version("main")

    variant("shared", default=True, description="Build a shared library")
    variant("openmp", default=True, description="Use threads in sweeps")
    variant("gnuplot", default=False, description="Draw pictures")

    depends_on("c", type="build")
    depends_on("fortran", type="build")
    depends_on("cmake@3.20:", type="build")
    depends_on("lapack")
    depends_on("blas")
    depends_on("gnuplot", type="run", when="+gnuplot")

    conflicts("%gcc@:10")

    def cmake_args(self):
        return [
            self.define_from_variant("BUILD_SHARED_LIBS", "shared"),
            self.define_from_variant("GESTELL_OPENMP", "openmp"),
            self.define_from_variant("GESTELL_FORTRAN_SYMBOLS", "shared"),
            self.define("LAPACK_LIBRARIES", self.spec["lapack"].libs.joined(";")),
            self.define("BLAS_LIBRARIES", self.spec["blas"].libs.joined(";")),
        ]

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def check_program(self):
        """The program reports the stability of an example."""
        gestell = Executable(self.prefix.bin.gestell)
        gestell("--one-line", join_path(self.stage.source_path, "data", "khang_four_bar.nml"))
