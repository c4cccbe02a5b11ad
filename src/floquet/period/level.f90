!> Phi(T) and x_p(T) with a number of steps, and how far two such solutions differ.
module gestell_floquet_period_level
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: balanced
  use gestell_floquet_integrator_mesh, only: mesh
  use gestell_floquet_integrator_method, only: method_type, unseen_type
  use gestell_floquet_period_period_map, only: period_map, period_map_type
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: distance, roundoff, solve_level

  !> The period's map with a number of steps, and what their nodes do not tell.
  type, public, extends(period_map_type) :: level_type
    real(dp), allocatable :: nodes(:)
    real(dp) :: norm = 0, xp_peak = 0, transient_growth = 1
    integer :: steps = 0, stages = 0
    type(unseen_type) :: unseen
  end type level_type

contains

  !> With so many steps, in units `scale` of the states; `lower`, shape (2): by the methods that are embedded.
  !> Errors: as of `period_map`.
  subroutine solve_level(system, method, scale, steps, forced, level, error, lower)
    class(periodic_system), intent(in) :: system
    class(method_type), intent(in) :: method
    real(dp), contiguous, intent(in) :: scale(:)
    integer, intent(in) :: steps
    logical, intent(in) :: forced
    type(level_type), intent(out) :: level
    type(error_type), allocatable, intent(out) :: error
    type(period_map_type), intent(out), optional :: lower(:)

    level%nodes = mesh(system, steps)
    level%steps = size(level%nodes) - 1
    level%stages = method%stages
    allocate(level%phi(system%states, system%states))
    ! What is not allocated is absent where it is an argument.
    if (forced) allocate(level%xp(system%states))
    call period_map(system, method, level%nodes, scale, level%phi, error, level%xp, level%xp_peak, level%transient_growth, lower, &
      & level%unseen)
    if (.not. allocated(error)) level%norm = norm2(balanced(level%phi, scale))
  end subroutine solve_level

  !> Differences of Phi(T) and of x_p(T) between two solutions, relative to the `other`. Where all free vibrations die
  !> out below the smallest number, Phi(T) is zero to within that.
  pure function distance(one, other, scale) result(d)
    type(level_type), intent(in) :: one, other
    real(dp), intent(in) :: scale(:)
    real(dp) :: d(2)

    d(1) = norm2(balanced(one%phi - other%phi, scale)) / max(other%norm, tiny(1.0_dp))
    d(2) = 0
    if (allocated(other%xp)) then
      if (other%xp_peak > 0) d(2) = norm2((one%xp - other%xp) / scale) / other%xp_peak
    end if
  end function distance

  !> What the arithmetic leaves uncertain, relative to Phi(T): the roundings of n numbers and of the stages in every step add up,
  !> for nearly constant coefficients all with the same sign, those of the coefficients shift the phase of the fastest motion; the
  !> model's own come on top. All count for more where Phi(t) was greater on the way.
  pure real(dp) function roundoff(system, level, phase_advance)
    class(periodic_system), intent(in) :: system
    type(level_type), intent(in) :: level
    real(dp), intent(in) :: phase_advance

    roundoff = (epsilon(1.0_dp) * ((size(level%phi, 1) + level%stages) * level%steps + 2 * phase_advance) + system%rounding) &
      & * level%transient_growth
  end function roundoff

end module gestell_floquet_period_level
