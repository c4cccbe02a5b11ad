!> Steps over the period.
module test_mesh
  use checks, only: check_that
  use gestell_base_kinds, only: dp
  use gestell_floquet_integrator_mesh, only: merged, mesh, refined
  use systems, only: constant_type
  use testdrive, only: check, error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_mesh

contains

  subroutine collect_mesh(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("steps end at breaks and close phases are merged", test_steps), &
      & new_unittest("steps through given phases are equal and no longer than the mesh's", test_refined)]
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
    call check_that(error, nodes([2, 3, 6, 7]), "<=", [0.125_dp, 0.25_dp, 1 - 1.0e-9_dp, 1.0_dp], "breaks to the last digit")
    call check_that(error, nodes([2, 3, 6, 7]), ">=", [0.125_dp, 0.25_dp, 1 - 1.0e-9_dp, 1.0_dp], "breaks to the last digit")
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

  !> Steps that pass through equidistant phases are equal, not longer than those of the mesh, and end at breaks.
  subroutine test_refined(error)
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: system
    real(dp), allocatable :: nodes(:), through(:)
    integer :: i, m

    system = constant_type(states=2, period=8.0_dp)
    do m = 1, 90
      nodes = mesh(system, m)
      through = refined(system, nodes, [(i / 40.0_dp, i = 0, 40)])
      call check(error, size(through), 1 + 40 * ((m + 39) / 40), more="steps through 40 phases")
      if (allocated(error)) return
      associate (n => size(through))
        call check_that(error, maxval(abs(through - [(i / real(n - 1, dp), i = 0, n - 1)])), "<", 2 * epsilon(1.0_dp), "equal")
      end associate
      if (allocated(error)) return
      through = refined(system, nodes, nodes)
      call check(error, size(through), m + 1, more="phases at the mesh's own ends")
      if (allocated(error)) return
    end do
    ! Invalid nodes: no more steps than nodes and phases together.
    through = refined(system, [0.0_dp, 0.5_dp, 0.5_dp, 0.5_dp + 1.0e-9_dp, 1.0_dp], [0.0_dp, 0.25_dp, 0.75_dp, 1.0_dp])
    call check_that(error, size(through), "<=", 9, "invalid nodes")
    through = refined(system, [0.0_dp, 1.0e-9_dp], [0.5_dp, 1.0_dp])
    call check_that(error, size(through), "<=", 4, "phases beyond the nodes")
    if (allocated(error)) return
    ! A break at 0.3: 3 steps of 0.1 and 7, which 0.45 and 0.5 divide into 3 parts of 2, 1 and 5 steps.
    system%breaks = [2.4_dp]
    through = refined(system, mesh(system, 10), [0.45_dp, 0.5_dp])
    call check(error, size(through), 12)
    if (allocated(error)) return
    call check_that(error, maxval(abs(through([4, 5, 6, 7, 8]) - [0.3_dp, 0.375_dp, 0.45_dp, 0.5_dp, 0.6_dp])), "<", &
      & 2 * epsilon(1.0_dp), "through break and phases")
    if (allocated(error)) return
    ! Unequal steps next to a break keep their lengths, also in a part of the mesh.
    system%breaks = [1.0_dp]
    nodes = mesh(system, 4, [0.25_dp, 0.5_dp])
    nodes = [nodes(:3), 0.375_dp, nodes(4:)]
    through = refined(system, nodes(2:5), [0.25_dp])
    call check(error, size(through), 4)
    if (allocated(error)) return
    call check_that(error, maxval(abs(through - nodes(2:5))), "<=", 0.0_dp, "part of a mesh")
  end subroutine test_refined

end module test_mesh
