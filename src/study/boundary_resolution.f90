!> As many search points on a line as its border functions need.
module gestell_study_boundary_resolution
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_boundary_functions, only: border_kinds, flutter
  use gestell_study_boundary_line, only: line_type, probe_line, probe_type
  use gestell_study_family, only: family_type
  implicit none (type, external)
  private

  public :: resolve

  !> So often an interval is halved.
  integer, parameter :: most_halvings = 4
  !> A function is resolved where its neighbours tell its value so well, relative to the greatest of theirs.
  real(dp), parameter :: enough = 0.1_dp

contains

  !> Halves the intervals beside points at which a border function is not about what the polynomial through its neighbours,
  !> two on either side, says: dips between the points would go unseen there. Error: the parameters make no sense.
  subroutine resolve(family, line, probes, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    type(probe_type), allocatable, intent(inout) :: probes(:)
    type(error_type), allocatable, intent(out) :: error
    type(probe_type), allocatable :: more(:)
    logical, allocatable :: halve(:)
    integer :: level, i, k

    do level = 1, most_halvings
      allocate(halve(size(probes)), source=.false.)
      do i = 2, size(probes) - 1
        if (surprising(probes(max(i - 2, 1):min(i + 2, size(probes))), min(i, 3))) halve(i - 1:i) = .true.
      end do
      if (.not. any(halve)) return
      allocate(more(size(probes) + count(halve)))
      k = 0
      do i = 1, size(probes)
        k = k + 1
        more(k) = probes(i)
        if (.not. halve(i)) cycle
        k = k + 1
        call probe_line(family, line, (probes(i)%t + probes(i + 1)%t) / 2, more(k), error)
        if (allocated(error)) return
      end do
      call move_alloc(more, probes)
      deallocate(halve)
    end do
  end subroutine resolve

  !> Whether one of the functions at point `here` is far from the polynomial through the others, four or three.
  pure logical function surprising(probes, here)
    type(probe_type), intent(in) :: probes(:)
    integer, intent(in) :: here
    real(dp) :: weight, told
    integer :: kind, i, j

    surprising = .false.
    if (size(probes) < 4 .or. any(probes%missing())) return
    do kind = 1, border_kinds
      if (.not. all(probes%known(kind))) cycle
      if (kind == flutter .and. any(probes%reciprocal .neqv. probes(here)%reciprocal)) cycle
      told = 0
      do i = 1, size(probes)
        if (i == here) cycle
        weight = 1
        do j = 1, size(probes)
          if (j /= i .and. j /= here) weight = weight * (probes(here)%t - probes(j)%t) / (probes(i)%t - probes(j)%t)
        end do
        told = told + weight * probes(i)%f(kind)
      end do
      surprising = abs(told - probes(here)%f(kind)) > enough * maxval(abs(probes%f(kind)))
      if (surprising) return
    end do
  end function surprising

end module gestell_study_boundary_resolution
