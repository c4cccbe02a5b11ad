!> All borders along a line that its search points give away.
module gestell_study_boundary_scan
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_boundary_crossing, only: crossings_type, last_before, same_sign, separate
  use gestell_study_boundary_functions, only: border_kinds, flutter
  use gestell_study_boundary_line, only: line_type, probe_line, probe_type
  use gestell_study_boundary_resolution, only: resolve
  use gestell_study_boundary_root, only: approach_zero
  use gestell_study_family, only: family_type
  implicit none (type, external)
  private

  public :: probe_all, scan_line

  !> So many borders are told apart between two search points, as a power of two.
  integer, parameter, public :: usual_depth = 6

contains

  !> Systems at `t`.
  subroutine probe_all(family, line, t, probes, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    real(dp), intent(in) :: t(:)
    type(probe_type), allocatable, intent(out) :: probes(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    allocate(probes(size(t)))
    do i = 1, size(t)
      call probe_line(family, line, t(i), probes(i), error)
      if (allocated(error)) return
    end do
  end subroutine probe_all

  !> Borders between the first and the last of the `nodes`, ascending, in pieces where there are systems.
  !>
  !> Nodes are added where they do not resolve the functions. Between neighbours the functions' signs and the verdicts are
  !> compared. Where a function does not change its sign but is nearest to zero at a node, it is followed to its minimum: a
  !> narrow region may lie there.
  !> Error: the parameters make no sense.
  subroutine scan_line(family, line, nodes, found, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    type(probe_type), intent(in) :: nodes(:)
    type(crossings_type), intent(out) :: found
    type(error_type), allocatable, intent(out) :: error
    !> One more search point beside each end: what falls away from the end has a minimum there.
    real(dp), parameter :: beside = 0.01_dp
    type(probe_type), allocatable :: probes(:), resolved(:)
    type(probe_type) :: last
    integer :: n, i, kind

    allocate(resolved(size(nodes)))
    resolved = nodes
    call resolve(family, line, resolved, error)
    if (allocated(error)) return
    n = size(resolved) + 2
    allocate(probes(n))
    probes(1) = resolved(1)
    probes(3:n - 2) = resolved(2:n - 3)
    probes(n) = resolved(n - 2)
    associate (first => probes(1)%t, final => probes(n)%t)
      call probe_line(family, line, first + beside * (resolved(2)%t - first), probes(2), error)
      if (allocated(error)) return
      call probe_line(family, line, final - beside * (final - resolved(n - 3)%t), probes(n - 1), error)
      if (allocated(error)) return
    end associate

    do i = 1, n - 1
      associate (l => probes(i), r => probes(i + 1))
        if (l%missing() .and. r%missing()) cycle
        if (r%missing()) then
          call last_before(family, line, l, r, last, error)
          if (.not. allocated(error)) call separate(family, line, l, last, usual_depth, found, error)
        else if (l%missing()) then
          call last_before(family, line, r, l, last, error)
          if (.not. allocated(error)) call separate(family, line, last, r, usual_depth, found, error)
        else
          call separate(family, line, l, r, usual_depth, found, error)
        end if
        if (allocated(error)) return
      end associate
    end do
    do i = 2, n - 1
      if (any(probes(i - 1:i + 1)%missing())) cycle
      do kind = 1, border_kinds
        if (dips(probes(i - 1), probes(i), probes(i + 1), kind)) then
          call look_closer(family, line, kind, probes(i - 1), probes(i), probes(i + 1), found, error)
        end if
        if (allocated(error)) return
      end do
    end do
    call found%sort(2 * line%step())
  end subroutine scan_line

  !> Whether the function `kind` has one sign at three points and comes nearest to zero at the middle one.
  pure logical function dips(l, m, r, kind)
    type(probe_type), intent(in) :: l, m, r
    integer, intent(in) :: kind

    dips = .false.
    if (.not. (l%known(kind) .and. r%known(kind))) return
    if (.not. (same_sign(l%f(kind), m%f(kind)) .and. same_sign(m%f(kind), r%f(kind)))) return
    if (kind == flutter .and. ((l%reciprocal .neqv. m%reciprocal) .or. (m%reciprocal .neqv. r%reciprocal))) return
    dips = abs(m%f(kind)) <= abs(l%f(kind)) .and. abs(m%f(kind)) < abs(r%f(kind))
  end function dips

  !> The borders about the least value of a function, if there are any. What changes the verdict first may be another
  !> function's region nearby: then the function is followed once more, as far as its own zeros.
  subroutine look_closer(family, line, kind, l, m, r, found, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    integer, intent(in) :: kind
    type(probe_type), intent(in) :: l, m, r
    type(crossings_type), intent(inout) :: found
    type(error_type), allocatable, intent(out) :: error
    type(probe_type) :: new, low, high
    logical :: event
    integer :: attempt

    do attempt = 1, 2
      call approach_zero(family, line, kind, l, m, r, attempt == 1, new, event, error)
      if (allocated(error) .or. .not. event) return
      low = new
      high = new
      if (new%missing()) then
        call last_before(family, line, l, new, low, error)
        if (.not. allocated(error)) call last_before(family, line, r, new, high, error)
        if (allocated(error)) return
      end if
      call separate(family, line, l, low, usual_depth, found, error)
      if (.not. allocated(error)) call separate(family, line, high, r, usual_depth, found, error)
      if (allocated(error) .or. new%missing() .or. .not. same_sign(new%f(kind), l%f(kind))) return
    end do
  end subroutine look_closer

end module gestell_study_boundary_scan
