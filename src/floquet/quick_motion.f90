!> The periodic motion at equidistant phases by one integration whose steps end there: a tenth of what a solution with its evidence
!> takes. For corrections of a motion, whose own errors count for little.
module gestell_floquet_quick_motion
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_lapack, only: inverse
  use gestell_base_matrix, only: balanced, unit_matrix
  use gestell_base_text, only: text
  use gestell_floquet_flow, only: motions
  use gestell_floquet_method, only: method_type
  use gestell_floquet_methods, only: new_method
  use gestell_floquet_monodromy, only: survey
  use gestell_floquet_gauss, only: gauss
  use gestell_floquet_turn_errors, only: relative_rounding
  use gestell_system_periodic, only: periodic_system
  implicit none (type, external)
  private

  public :: solve_quickly

  type, public :: quick_motion_type
    !> The states at the phases (k - 1)/phases, shape (n, phases), and units that make them comparable, shape (n).
    real(dp), allocatable :: x(:, :), scale(:)
    !> Estimates of their errors by rounding and by the steps, relative to the motion.
    real(dp) :: rounding = 0, truncation = 0
    !> Radians by which the fastest vibration turns within the period.
    real(dp) :: turns = 0
  end type quick_motion_type

  !> Where the fastest vibration turns further (rad) reduction is quicker.
  real(dp), parameter :: most_turns = 700
  !> Error of Phi(T) where no multiplier is near 1, by that of the motion which is allowed.
  real(dp), parameter :: of_map = 1.0e-2_dp
  !> Steps between two phases.
  integer, parameter :: most_between = 8

contains

  !> `of_motion`: the error of the motion that is allowed, relative to it. `fits` is false where this is no way: the fastest
  !> vibration turns far, the coefficients jump, or a multiplier is so near 1 that the motion would have no digits. `motion` is one
  !> of a system that differs little, or none: units and turns are kept.
  subroutine solve_quickly(system, phases, of_motion, motion, fits)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: phases
    real(dp), intent(in) :: of_motion
    type(quick_motion_type), intent(inout) :: motion
    logical, intent(out) :: fits
    class(method_type), allocatable :: method
    type(error_type), allocatable :: error
    real(dp) :: maps(system%states, system%states + 1, phases), inverted(system%states, system%states)
    real(dp) :: x0(system%states), tolerance, amplification
    integer :: n, between, k

    fits = .false.
    if (allocated(system%breaks)) return
    if (.not. allocated(motion%scale)) then
      call survey(system, motion%scale, motion%turns, error)
      if (allocated(error)) return
    end if
    if (motion%turns > most_turns) return
    n = system%states
    tolerance = of_map * of_motion
    do
      call choose(system, phases, motion%turns, tolerance, method, between)
      if (between == 0) return
      call motions(system, method, [(real(k, dp) / (between * phases), k = 0, between * phases)], maps, error)
      if (.not. allocated(error)) call invert(maps(:, :n, phases), motion%scale, inverted, error)
      if (allocated(error)) return
      ! Where Phi is great (E - Phi)^-1 is small, and lost in rounding where other multipliers are not great.
      amplification = max(norm2(inverted), 1.0_dp)
      if (amplification * tolerance <= of_motion) exit
      ! Beside a resonance errors of Phi(T) show enlarged.
      tolerance = of_motion / (2 * amplification)
    end do
    motion%truncation = amplification * tolerance
    motion%rounding = amplification * (1 + norm2(balanced(maps(:, :n, phases), motion%scale))) &
      & * relative_rounding(system, between * phases, motion%turns)
    if (.not. motion%rounding < of_motion) return
    x0 = motion%scale * matmul(inverted, maps(:, n + 1, phases) / motion%scale)
    if (allocated(motion%x)) deallocate(motion%x)
    allocate(motion%x(n, phases))
    motion%x(:, 1) = x0
    do k = 1, phases - 1
      motion%x(:, k + 1) = matmul(maps(:, :n, k), x0) + maps(:, n + 1, k)
    end do
    fits = .true.
  end subroutine solve_quickly

  !> (E - Phi)^-1 in balanced units.
  subroutine invert(phi, scale, inverted, error)
    real(dp), intent(in) :: phi(:, :), scale(:)
    real(dp), intent(out) :: inverted(:, :)
    type(error_type), allocatable, intent(out) :: error
    real(dp), allocatable :: found(:, :)

    call inverse(unit_matrix(size(scale)) - balanced(phi, scale), found, error)
    if (.not. allocated(error)) inverted = found
  end subroutine invert

  !> The stages of Gauss collocation, and how many steps `between` two phases, with the least work for `tolerance` (as in
  !> gestell_floquet_methods); zero: there are none.
  subroutine choose(system, phases, turns, tolerance, method, between)
    class(periodic_system), intent(in) :: system
    integer, intent(in) :: phases
    real(dp), intent(in) :: turns, tolerance
    class(method_type), allocatable, intent(out) :: method
    integer, intent(out) :: between
    class(method_type), allocatable :: candidate
    type(error_type), allocatable :: error
    real(dp) :: angle, work, least_work
    integer :: stages, best, steps

    between = 0
    least_work = huge(least_work)
    best = 0
    do stages = 3, 10
      candidate = gauss(stages)
      steps = 1
      angle = 0.8_dp * turns + candidate%order * system%least_steps / 8.0_dp
      do while (steps <= most_between)
        if (candidate%error_constant * max(turns, 1.0_dp) * (angle / (steps * phases))**candidate%order <= tolerance &
          & .and. steps * phases >= system%least_steps) exit
        steps = 2 * steps
      end do
      if (steps > most_between) cycle
      work = candidate%work(system%states, .true.) * steps
      if (work >= least_work) cycle
      least_work = work
      best = stages
      between = steps
    end do
    if (between > 0) call new_method("gauss" // text(best), method, error)
  end subroutine choose

end module gestell_floquet_quick_motion
