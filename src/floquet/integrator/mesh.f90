!> Meshes: the ends of the steps over one period, as phases t / T in [0, 1].
module gestell_floquet_integrator_mesh
  use gestell_base_kinds, only: dp
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: mesh, merged, refined

contains

  !> Ends of about `steps` steps over the period of `system`; shape (0:number of steps), from 0 to 1. Breaks of the coefficients and
  !> the ascending phases `marks` are always ends of steps. Between two neighbouring breaks or marks all steps are equal.
  pure function mesh(system, steps, marks) result(nodes)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: steps
    real(dp), intent(in), optional :: marks(:)
    real(dp), allocatable :: nodes(:), ends(:)
    integer, allocatable :: first(:)
    integer :: i, k

    if (allocated(system%breaks)) then
      allocate(ends, source=[0.0_dp, system%breaks / system%period, 1.0_dp])
    else
      allocate(ends, source=[0.0_dp, 1.0_dp])
    end if

    if (present(marks)) ends = merged(ends, marks)

    ! Number of the first step of every segment; a segment has at least one step.
    allocate(first(size(ends)), source=0)
    do k = 2, size(ends)
      first(k) = first(k - 1) + max(1, ceiling(steps * (ends(k) - ends(k - 1)) - sqrt(epsilon(1.0_dp))))
    end do

    allocate(nodes(0:first(size(first))))
    do k = 2, size(ends)
      associate (count => first(k) - first(k - 1))
        do i = 0, count
          nodes(first(k - 1) + i) = ends(k - 1) + (ends(k) - ends(k - 1)) * i / count
        end do
      end associate
      nodes(first(k)) = ends(k)
    end do
  end function mesh

  !> Ends of steps that are at most as long as the steps between `nodes`, which are the mesh of `system` or a part of it. Breaks and
  !> the ascending `phases` are always ends of steps. Between two neighbouring breaks or phases all steps are equal, so equidistant
  !> phases give equal steps everywhere.
  pure function refined(system, nodes, phases)
    class(periodic_system), intent(in) :: system
    real(dp), intent(in) :: nodes(:), phases(:)
    real(dp), allocatable :: refined(:), ends(:)
    integer :: before, after, length, count, i, k

    ends = merged([nodes(1), nodes(size(nodes))], phases)
    if (allocated(system%breaks)) then
      associate (breaks => system%breaks / system%period)
        ends = merged(ends, pack(breaks, breaks > nodes(1) .and. breaks < nodes(size(nodes))))
      end associate
    end if
    allocate(refined(size(nodes) + size(ends)))
    refined(1) = ends(1)
    length = 1
    after = 1
    do k = 2, size(ends)
      ! The steps of the mesh that overlap this interval; between breaks they are equal.
      before = min(after, size(nodes) - 1)
      do while (before > 1 .and. nodes(before) > ends(k - 1))
        before = before - 1
      end do
      do while (before < size(nodes) - 1 .and. nodes(before + 1) <= ends(k - 1))
        before = before + 1
      end do
      after = before + 1
      do while (after < size(nodes) .and. nodes(after) < ends(k))
        after = after + 1
      end do
      associate (interval => ends(k) - ends(k - 1))
        count = max(1, ceiling((after - before) * interval / max(nodes(after) - nodes(before), interval) - sqrt(epsilon(1.0_dp))))
      end associate
      do i = 1, count - 1
        refined(length + i) = ends(k - 1) + (ends(k) - ends(k - 1)) * i / count
      end do
      length = length + count
      refined(length) = ends(k)
    end do
    refined = refined(:length)
  end function refined

  !> Merges the ascending sequences `a` and `b` to one ascending sequence. A number that occurs in both appears once in the result.
  pure function merged(a, b) result(c)
    real(dp), intent(in) :: a(:), b(:)
    real(dp), allocatable :: c(:)
    real(dp) :: least
    integer :: i, j, length

    allocate(c(size(a) + size(b)))
    i = 1
    j = 1
    length = 0
    do while (i <= size(a) .or. j <= size(b))
      least = huge(least)
      if (i <= size(a)) least = a(i)
      if (j <= size(b)) least = min(least, b(j))
      length = length + 1
      c(length) = least
      if (i <= size(a)) i = i + merge(1, 0, a(i) <= least)
      if (j <= size(b)) j = j + merge(1, 0, b(j) <= least)
    end do
    c = c(:length)
  end function merged

end module gestell_floquet_integrator_mesh
