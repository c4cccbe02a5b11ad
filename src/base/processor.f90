!> Detects vector instructions of the processor that a portable program cannot take for granted.
!>
!> Some procedures contain loops over eight numbers (lanes) that vector instructions process together. GCC compiles such a
!> procedure in several versions, one for each length of the vector registers, if it is declared with `declare simd simdlen(2)`,
!> as if it handled two calls at once. The second call, with `once` = 2, returns immediately. If GCC splits the procedure at this
!> return, only the part before the return gets versions. A local array that is set before the return and used after it prevents
!> the split; `.ci/versions` checks the result. The names of the versions encode the arguments: u for a uniform argument, l for
!> the linear argument `once`. C names begin with "lanes" because the C interface exports every name that begins with "gestell".
module gestell_base_processor
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version
  implicit none (type, external)
  private

  public :: has_long_vectors, vector_length

  !> True if the compiler generates versions of `!$omp declare simd` procedures that can be called by name (Vector Function
  !> Application Binary Interface, section 2.6: _ZGVdN..., _ZGVeN...). GCC does so for -march=x86-64 with optimisation and OpenMP.
  !> With any other -march the whole program is compiled for one processor and needs no versions.
  logical, parameter, public :: has_versions = index(compiler_version(), "GCC") > 0 .and. &
    & index(compiler_options(), "-march=x86-64 ") > 0 .and. index(compiler_options(), "-fopenmp") > 0 .and. &
    & (index(compiler_options(), "-O3") > 0 .or. index(compiler_options(), "-O2") > 0)

  !> Properties of the processor, which libgcc detects before the program begins (GCC, libgcc/config/i386/cpuinfo.h). If libgcc has
  !> no such variable, all elements are zero. Gestell never changes them.
  integer(c_int), bind(C, name="__cpu_model") :: cpu_model(4)

  !> Bit numbers in cpu_model(4).
  integer, parameter :: avx2 = 10, avx512f = 15

contains

  !> Number of double-precision numbers in a vector register of this processor: 8 with AVX-512, 4 with AVX2, otherwise 0. Also 0
  !> if the compiler generates no versions for these registers (see `has_versions`).
  pure integer function vector_length()
    vector_length = 0
    if (.not. has_versions) return
    if (btest(cpu_model(4), avx2)) vector_length = 4
    if (has_long_vectors()) vector_length = 8
  end function vector_length

  !> True if the processor supports AVX-512 and therefore has 32 vector registers.
  pure logical function has_long_vectors()
    has_long_vectors = btest(cpu_model(4), avx512f)
  end function has_long_vectors

end module gestell_base_processor
