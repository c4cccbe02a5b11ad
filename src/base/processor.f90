!> What the processor at hand can do that a portable program does not take for granted.
!>
!> A procedure with loops over eight lanes has a version for each kind of vectors: GCC makes one of a procedure that is declared as
!> one of two side by side, simdlen(2), of which the second, `once` = 2, returns. Where GCC splits a procedure at this return its
!> versions are of the beginning alone: a local array that is set before and used afterwards prevents that. `.ci/versions` looks at
!> what was made. The names of the versions follow from the arguments: u for each that is uniform, l for `once`. The names in C
!> begin with "lanes", as the door for C exports what begins with "gestell".
module gestell_base_processor
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: compiler_options, compiler_version
  implicit none (type, external)
  private

  public :: has_long_vectors, vector_length

  !> Whether the compiler makes versions of `!$omp declare simd` procedures for all processors of a family under names that can be
  !> called (Vector Function Application Binary Interface, section 2.6: _ZGVdN..., _ZGVeN...): GCC does for x86, with optimisation
  !> and OpenMP. Where it is told a processor (-march) no others are needed.
  logical, parameter, public :: has_versions = index(compiler_version(), "GCC") > 0 .and. &
    & index(compiler_options(), "-march=x86-64 ") > 0 .and. index(compiler_options(), "-fopenmp") > 0 .and. &
    & (index(compiler_options(), "-O3") > 0 .or. index(compiler_options(), "-O2") > 0)

  !> What libgcc knows of the processor (GCC, libgcc/config/i386/cpuinfo.h), set before the program begins; a linker that does not
  !> find it there leaves zeros. Nothing here changes it.
  integer(c_int), bind(C, name="__cpu_model") :: cpu_model(4)

  !> Bits of its last word.
  integer, parameter :: avx2 = 10, avx512f = 15

contains

  !> Numbers of double precision in a vector register for which there are versions: 8 (AVX-512), 4 (AVX2), or 0.
  pure integer function vector_length()
    vector_length = 0
    if (.not. has_versions) return
    if (btest(cpu_model(4), avx2)) vector_length = 4
    if (has_long_vectors()) vector_length = 8
  end function vector_length

  !> Whether the processor has AVX-512, and with it 32 registers for vectors.
  pure logical function has_long_vectors()
    has_long_vectors = btest(cpu_model(4), avx512f)
  end function has_long_vectors

end module gestell_base_processor
