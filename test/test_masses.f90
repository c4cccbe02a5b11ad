!> Masses of a crank: averaged over the turn against hand calculation, and balanced except for rounding.
module test_masses
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mechanism, only: mass_functions_type
  use systems, only: diagonal
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_masses

contains

  subroutine collect_masses(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("natural frequencies follow from mean mass and symmetric stiffness", test_averaged), &
      & new_unittest("rounding does not make a balanced mechanism shake; small unbalance does", test_nearly_balanced)]
  end subroutine collect_masses

  !> A crank with its mass off the pivot at the frame's F: a1 and a2 average to zero, a3 = m r^2. Of the stiffness only
  !> the symmetric part has an energy; a negative spring has no frequency but a growth.
  subroutine test_averaged(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(frame_type) :: frame
    type(gestell_error), allocatable :: failure
    real(dp) :: stiffness(3, 3)
    real(dp), allocatable :: w(:)

    call linkage%ground("O", [0.0_dp, 0.0_dp], failure)
    call linkage%crank("A", "O", 0.1_dp, 0.0_dp, failure)
    call linkage%link("crank", "O", "A", 2.0_dp, 0.25_dp, [0.3_dp, 0.4_dp], failure)
    stiffness = diagonal([6.0_dp * 49, -6.0_dp * 25, 2.0_dp])
    stiffness(1, 2) = 3
    stiffness(2, 1) = -3
    call new_frame(frame, linkage, 4.0_dp, 1.25_dp, [0.0_dp, 0.0_dp], stiffness, diagonal([0.0_dp, 0.0_dp, 0.0_dp]), 30.0_dp, &
      & failure)
    if (.not. allocated(failure)) call frame%natural_frequencies(w, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    ! m = 4 + 2, J = 1.25 + 0.25 + 2 * 0.25.
    call check_that(error, maxval(abs(w - [-5.0_dp, 1.0_dp, 7.0_dp])), "<", 1.0e-13_dp, "frequencies")
    if (allocated(error)) return
    call new_frame(frame, linkage, 4.0_dp, 1.25_dp, [0.0_dp, 0.0_dp], stiffness, diagonal([0.0_dp, 0.0_dp, 0.0_dp]), 30.0_dp, &
      & failure, [3])
    call frame%natural_frequencies(w, failure)
    call check_that(error, size(w), "==", 1, "degrees of freedom")
    call check_that(error, abs(w(1) - 1), "<", 1.0e-14_dp, "frequency")
  end subroutine test_averaged

  !> m c of the crank's two bodies cancel but for the rounding of the products, at all angles, those on the axes too,
  !> and wherever the pivot is. An unbalance of 1e-9 is there to its own digits.
  subroutine test_nearly_balanced(error)
    type(error_type), allocatable, intent(out) :: error
    type(linkage_type) :: linkage
    type(mass_functions_type) :: a
    type(gestell_error), allocatable :: failure
    real(dp) :: center(2), unbalance, known
    integer :: i, k

    do i = 1, 40
      unbalance = merge(0.0_dp, 1.0e-9_dp, modulo(i, 4) > 0)
      center = 0.1_dp * i / 3 * [1.0_dp, merge(0.0_dp, 1 / 7.0_dp, i > 20)]
      known = 0.7_dp * norm2(center) * unbalance
      linkage = linkage_type()
      call linkage%ground("O", merge([0.0_dp, 0.0_dp], [0.31_dp, -0.23_dp], modulo(i, 4) /= 2), failure)
      call linkage%crank("A", "O", 0.1_dp, 0.0_dp, failure)
      call linkage%link("crank", "O", "A", 0.7_dp, 0.0_dp, center, failure)
      call linkage%link("counterweight", "O", "A", 2.1_dp, 0.0_dp, -center / 3 * (1 + unbalance), failure)
      do k = 0, 24
        call linkage%mass_functions(k * pi / 12, a)
        if (unbalance > 0) then
          ! Known to roundings of the two parts.
          call check(error, hypot(a%a1%v, a%a2%v), known, thr=1.0e-15_dp * norm2(center), more="unbalance")
          if (allocated(error)) return
          call check(error, hypot(a%a1%d, a%a2%d), known, thr=1.0e-15_dp * norm2(center), more="unbalance'")
        else
          call check(error, sum(abs([a%a1%d, a%a2%d, a%a1%dd, a%a2%dd, a%a4])), 0.0_dp, more="balanced")
          if (allocated(error)) return
          if (modulo(i, 4) /= 2) call check(error, abs(a%a1%v) + abs(a%a2%v), 0.0_dp, more="balanced about O")
        end if
        if (allocated(error)) return
      end do
    end do
  end subroutine test_nearly_balanced

end module test_masses
