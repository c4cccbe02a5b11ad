!> Where a border function changes its sign, where the verdict changes, and where a function comes nearest to zero.
module gestell_study_boundary_root
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_study_boundary_functions, only: flutter
  use gestell_study_boundary_line, only: line_type, probe_line, probe_type
  use gestell_study_family, only: family_type
  use gestell_study_tile_results, only: undecided
  implicit none (type, external)
  private

  public :: approach_zero, find_change, find_root

  !> A root is found that much more exactly than borders are told.
  real(dp), parameter :: share = 0.125_dp

contains

  !> A zero of the function `kind` between `l` and `r`, where its signs differ, by inverse quadratic interpolation where
  !> that is safe and bisection elsewhere (Chandrupatla, Adv. Eng. Software 28, 1997, 145). `obstacle` is missing if there
  !> is a point without a system on the way.
  subroutine find_root(family, line, kind, l, r, t, obstacle, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    integer, intent(in) :: kind
    type(probe_type), intent(in) :: l, r
    real(dp), intent(out) :: t
    type(probe_type), intent(out) :: obstacle
    type(error_type), allocatable, intent(out) :: error
    type(probe_type) :: new
    real(dp) :: a, b, c, fa, fb, fc, part, least

    obstacle%verdict = undecided
    a = r%t
    fa = r%f(kind)
    b = l%t
    fb = l%f(kind)
    part = 0.5_dp
    do
      call probe_line(family, line, a + part * (b - a), new, error)
      if (allocated(error)) return
      if (new%missing()) then
        obstacle = new
        return
      end if
      ! [a, b] stays the bracket, a the newest point, c the one before.
      if ((new%f(kind) > 0) .eqv. (fa > 0)) then
        c = a
        fc = fa
      else
        c = b
        fc = fb
        b = a
        fb = fa
      end if
      a = new%t
      fa = new%f(kind)
      t = merge(a, b, abs(fa) < abs(fb))
      least = (share * line%step() + 2 * spacing(t)) / abs(b - a)
      if (least > 0.5_dp .or. .not. abs(fa) > 0) return
      ! Of another nature: its sign says nothing any more.
      if (kind == flutter .and. (new%reciprocal .neqv. l%reciprocal)) return
      part = 0.5_dp
      associate (xi => (a - b) / (c - b), phi => (fa - fb) / (fc - fb))
        if (phi**2 < xi .and. (1 - phi)**2 < 1 - xi) then
          part = fa / (fb - fa) * (fc / (fb - fc)) + (c - a) / (b - a) * (fa / (fc - fa)) * (fb / (fc - fb))
        end if
      end associate
      part = min(max(part, least), 1 - least)
    end do
  end subroutine find_root

  !> Where the verdict changes from unstable to another, or back, by bisection.
  subroutine find_change(family, line, l, r, t, obstacle, error)
    class(family_type), intent(in) :: family
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
      call probe_line(family, line, t, new, error)
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

  !> Follows |f(kind)|, which is least at `m` of the three points, to its minimum until its sign changes, the system is missing,
  !> or with `any_change` the verdict changes: `new` is that point, `event` that there is one. Every other step takes the
  !> minimum of the parabola through the three points, the others the golden section; where the parabola remains far from
  !> zero the search ends.
  subroutine approach_zero(family, line, kind, l, m, r, any_change, new, event, error)
    class(family_type), intent(in) :: family
    type(line_type), intent(in) :: line
    integer, intent(in) :: kind
    type(probe_type), intent(in) :: l, m, r
    logical, intent(in) :: any_change
    type(probe_type), intent(out) :: new
    logical, intent(out) :: event
    type(error_type), allocatable, intent(out) :: error
    integer, parameter :: most_steps = 50
    real(dp), parameter :: golden = 0.381966_dp, narrowest = 1.0e-8_dp, hopeless = 0.5_dp, near = 3
    real(dp) :: sign_here, x(3), f(3), next, least, curvature, slope
    integer :: k

    event = .false.
    sign_here = sign(1.0_dp, l%f(kind))
    x = [l%t, m%t, r%t]
    f = sign_here * [l%f(kind), m%f(kind), r%f(kind)]
    do k = 1, most_steps
      if (x(3) - x(1) <= max(narrowest * (r%t - l%t), line%step())) return
      curvature = ((f(3) - f(2)) / (x(3) - x(2)) - (f(2) - f(1)) / (x(2) - x(1))) / (x(3) - x(1))
      ! f(2) + slope at x(2) times s + curvature s**2
      slope = (f(2) - f(1)) / (x(2) - x(1)) + curvature * (x(2) - x(1))
      next = x(2)
      least = f(2)
      if (curvature > 0) then
        next = x(2) - slope / (2 * curvature)
        least = f(2) - slope**2 / (4 * curvature)
      end if
      if (max(f(1), f(3)) < near * f(2) .and. least > hopeless * f(2)) return
      if (mod(k, 2) == 0 .or. abs(next - x(2)) < narrowest * (x(3) - x(1)) .or. next <= x(1) .or. next >= x(3)) then
        next = x(2) + golden * merge(x(3) - x(2), x(1) - x(2), x(3) - x(2) > x(2) - x(1))
      end if
      call probe_line(family, line, next, new, error)
      if (allocated(error)) return
      event = new%missing()
      if (event) return
      if (kind == flutter .and. (new%reciprocal .neqv. m%reciprocal)) return
      event = sign_here * new%f(kind) < 0 .or. (any_change .and. (new%is_unstable() .neqv. m%is_unstable()))
      if (event) return
      call narrow(x, f, next, sign_here * new%f(kind))
    end do
  end subroutine approach_zero

  !> Three points with the least in the middle, after a fourth came between them.
  pure subroutine narrow(x, f, new_x, new_f)
    real(dp), intent(inout) :: x(3), f(3)
    real(dp), intent(in) :: new_x, new_f

    if (new_f < f(2)) then
      if (new_x > x(2)) then
        x = [x(2), new_x, x(3)]
        f = [f(2), new_f, f(3)]
      else
        x = [x(1), new_x, x(2)]
        f = [f(1), new_f, f(2)]
      end if
    else if (new_x > x(2)) then
      x(3) = new_x
      f(3) = new_f
    else
      x(1) = new_x
      f(1) = new_f
    end if
  end subroutine narrow

end module gestell_study_boundary_root
