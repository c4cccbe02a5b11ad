!> Where a border function changes its sign, where the verdict changes, and where a function comes nearest to zero.
module gestell_task_boundary_line_root
  use gestell_base_error, only: error_type
  use gestell_base_verdict, only: undecided
  use gestell_base_kinds, only: dp
  use gestell_math_root_search, only: root_search_type
  use gestell_task_boundary_line_functions, only: flutter
  use gestell_task_boundary_line, only: line_type, probe_line, probe_type
  implicit none (type, external)
  private

  public :: find_change, find_root

  !> A root is found that much more exactly than borders are told.
  real(dp), parameter :: share = 0.125_dp

contains

  !> A zero of the function `kind` between `l` and `r`, where its signs differ. `obstacle` is missing if there is a point without
  !> a system on the way.
  subroutine find_root(line, kind, l, r, t, obstacle, error)
    type(line_type), intent(in) :: line
    integer, intent(in) :: kind
    type(probe_type), intent(in) :: l, r
    real(dp), intent(out) :: t
    type(probe_type), intent(out) :: obstacle
    type(error_type), allocatable, intent(out) :: error
    type(root_search_type) :: search
    type(probe_type) :: new

    obstacle%verdict = undecided
    call search%start(r%t, r%f(kind), l%t, l%f(kind))
    do
      t = search%root()
      associate (tolerance => share * line%step() + 2 * spacing(t))
        if (search%found(tolerance)) return
        call probe_line(line, search%next(tolerance), new, error)
      end associate
      if (allocated(error)) return
      if (new%missing()) then
        obstacle = new
        return
      end if
      call search%take(new%t, new%f(kind))
      ! Of another nature: its sign says nothing any more.
      if (kind == flutter .and. (new%reciprocal .neqv. l%reciprocal)) exit
    end do
    t = search%root()
  end subroutine find_root

  !> Where the verdict changes from unstable to another, or back, by bisection.
  subroutine find_change(line, l, r, t, obstacle, error)
    type(line_type), intent(in) :: line
    type(probe_type), intent(in) :: l, r
    real(dp), intent(out) :: t
    type(probe_type), intent(out) :: obstacle
    type(error_type), allocatable, intent(out) :: error
    type(probe_type) :: new
    real(dp) :: a, b

    obstacle%verdict = undecided
    a = l%t
    b = r%t
    do
      t = (a + b) / 2
      if (b - a <= max(share * line%step(), 4 * spacing(t))) return
      call probe_line(line, t, new, error)
      if (allocated(error)) return
      if (new%missing()) then
        obstacle = new
        return
      end if
      if (new%is_unstable() .eqv. l%is_unstable()) then
        a = t
      else
        b = t
      end if
    end do
  end subroutine find_change

end module gestell_task_boundary_line_root
