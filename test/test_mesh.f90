!> Steps over the period.
module test_mesh
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_mesh, only: merged, mesh
  use systems, only: constant_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_mesh

contains

  subroutine collect_mesh(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [new_unittest("steps between breaks, and merged phases", test_steps)]
  end subroutine collect_mesh

  subroutine test_steps(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    real(dp), allocatable :: nodes(:)
    integer :: i

    system = constant_type(states=2, period=8.0_dp)
    nodes = mesh(system, 7)
    call check(error, size(nodes), 8)
    if (allocated(error)) return
    call check_that(error, maxval(abs(nodes - [(i / 7.0_dp, i = 0, 7)])), "<", epsilon(1.0_dp), "even nodes")
    if (allocated(error)) return
    ! Breaks at 1/8, 1/4 and just before the end; a third of a step becomes a whole one, three steps of a sixth stay so.
    system%breaks = [1.0_dp, 2.0_dp, 8 * (1 - 1.0e-9_dp)]
    nodes = mesh(system, 4)
    call check(error, size(nodes), 7)
    if (allocated(error)) return
    call check_that(error, maxval(abs(nodes - [0.0_dp, 0.125_dp, 0.25_dp, 0.5_dp, 0.75_dp, 1 - 1.0e-9_dp, 1.0_dp])), "<", &
      & 1.0e-9_dp, "nodes with breaks")
    if (allocated(error)) return
    call check_that(error, nodes([2, 3, 6, 7]), "<=", [0.125_dp, 0.25_dp, 1 - 1.0e-9_dp, 1.0_dp], "breaks to the last digit")
    call check_that(error, nodes([2, 3, 6, 7]), ">=", [0.125_dp, 0.25_dp, 1 - 1.0e-9_dp, 1.0_dp], "breaks to the last digit")
    if (allocated(error)) return
    call check_that(error, nodes(2:), ">", nodes(:6), "ascending")
    if (allocated(error)) return
    ! Segments that the steps fit are not given one more by rounding.
    do i = 1, 40
      system%breaks = [8.0_dp / (3 * i)]
      nodes = mesh(system, 3 * i)
      call check(error, size(nodes), 3 * i + 1)
      if (allocated(error)) return
      system%breaks = 8 * [0.1_dp + 0.003_dp * i, 0.7_dp + 0.0017_dp * i]
      nodes = mesh(system, 17)
      call check(error, count(abs(nodes - system%breaks(1) / 8) <= 0) + count(abs(nodes - system%breaks(2) / 8) <= 0), 2, &
        & more="breaks to the last digit")
      if (allocated(error)) return
    end do

    system%breaks = 0.8_dp * [(i, i = 1, 9)]
    call check(error, size(mesh(system, 10)), 11)
    if (allocated(error)) return
    ! 2.5 and 7.5 steps are 3 and 8.
    system%breaks = [2.0_dp]
    call check(error, size(mesh(system, 10)), 12)
    if (allocated(error)) return

    nodes = merged([0.0_dp, 0.5_dp, 1.0_dp], [0.0_dp, 0.25_dp, 0.5_dp, 0.75_dp])
    call check(error, size(nodes), 5)
    if (allocated(error)) return
    call check(error, maxval(abs(nodes - [0.0_dp, 0.25_dp, 0.5_dp, 0.75_dp, 1.0_dp])), 0.0_dp)
  end subroutine test_steps

end module test_mesh
