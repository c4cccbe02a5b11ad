!> Computes the periodic vibration of a machine, and its derivatives with respect to parameters by direct differentiation. Let
!> R(q, p) = 0 be the equations of the vibration q at every phase theta of the turn, where p is a parameter. Then s = dq/dp is the
!> periodic motion of
!>
!>     M s'' + B s' + C s = -dR/dp,
!>
!> where M, B, C are the matrices of the equations linearised about q (doc/theory.md, equation 80). R depends algebraically on p
!> and on q, q', q'' (gestell_study_design_perturbed_members).
module gestell_study_design_motion
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp, pi
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_period_periodic_solution, only: periodic_solution_type
  use gestell_floquet_period_quick_motion, only: quick_motion_type
  use gestell_floquet_solution, only: floquet_type, follow, solve_floquet, solve_periodic
  use gestell_math_series_trigonometric, only: series_through, series_type
  use gestell_model_frame, only: frame_type
  use gestell_model_exact_varied_frame, only: varied_frame, varied_frame_type
  use gestell_study_design_coordinates, only: coordinates_type, find_coordinates, respond
  use gestell_study_design_perturbed_members, only: at_condition, condition_type, members_type
  use gestell_study_frame_model, only: settle
  use gestell_study_frame_model_newton, only: next_motion, next_type
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  private

  public :: derivative_tolerance, default_phases, get_neighbour, solve_motion, solve_slopes

  !> A machine under one condition, with a model of the frame applied, and its motion.
  type, public :: motion_type
    type(condition_type) :: condition
    class(frame_type), allocatable :: frame
    !> False if the frame stays at rest
    logical :: moves = .true.
    !> Fourier series of the motion q as a function of theta = 2 pi t/T
    type(series_type) :: series
    !> `phases`: equidistant phases. `q`: the motion and its first and second derivatives with respect to theta = 2 pi t/T, for all
    !> degrees of freedom, shape (phases, dofs, 0:2). `slope`: dq/dp and its derivatives with respect to theta, shape (phases, dofs,
    !> 0:2, parameters). `slope` is allocated by `solve_slopes`
    real(dp), allocatable :: phases(:), q(:, :, :), slope(:, :, :, :)
    !> The fast solution with its state-transition matrices. Empty unless the equations are linearised about rest and a fast
    !> solver computed the motion
    type(quick_motion_type) :: quick
  contains
    procedure :: parameters
  end type motion_type

  !> The system `inner` with its load replaced by a Fourier series over theta for each of its free degrees of freedom.
  type, extends(second_order_system) :: loaded_type
    class(second_order_system), pointer :: inner => null()
    type(series_type) :: force
  contains
    procedure :: matrices, sample_second_order, coupled, conserves
  end type loaded_type

  !> `fewest`: minimum number of phases. `max_corrections`: maximum number of iterations that correct the derivatives for terms of
  !> the equations that M, B, C do not contain.
  integer, parameter :: fewest = 64, max_corrections = 6
  !> Relative error allowed for the derivatives, and for the terms of the equations that are not contained in M, B, C.
  real(dp), parameter :: of_slope = 1.0e-10_dp

contains

  !> Default phases at which a motion is sampled, as fractions of the period: k / `fewest` for k = 0 ... `fewest` - 1. Motions
  !> with high harmonics are sampled at more phases.
  pure function default_phases() result(phases)
    real(dp) :: phases(fewest)
    integer :: k

    phases = [(real(k, dp) / fewest, k = 0, fewest - 1)]
  end function default_phases

  !> Number of parameters with respect to which the motion is differentiated.
  pure integer function parameters(self)
    class(motion_type), intent(in) :: self

    parameters = 0
    if (allocated(self%slope)) parameters = size(self%slope, 4)
  end function parameters

  !> Error allowed for the monodromy matrix Phi when derivatives are computed. It is larger than the tolerance, because the
  !> coefficients of the exact frame are only as accurate as its motion.
  pure real(dp) function derivative_tolerance(accuracy)
    type(accuracy_type), intent(in) :: accuracy

    derivative_tolerance = max(of_slope, 10 * accuracy%tolerance)
  end function derivative_tolerance

  !> Computes the periodic vibration of the machine under one operating condition. Fails if no periodic vibration exists (resonance
  !> without damping) or if the model finds none (see `settle`).
  subroutine solve_motion(members, condition, moves, motion, error, near)
    !> The machine, and its neighbours with one parameter changed each
    type(members_type), intent(in) :: members
    type(condition_type), intent(in) :: condition
    !> False if no goal needs the vibration; the frame then stays at rest
    logical, intent(in) :: moves
    type(motion_type), intent(out) :: motion
    type(error_type), allocatable, intent(out) :: error
    !> The motion under a similar condition; from it the search for the vibration of the exact frame starts
    type(motion_type), intent(in), optional :: near
    type(frame_type) :: run
    type(series_type), allocatable :: start
    type(next_type) :: next
    integer :: k, n

    motion%condition = condition
    motion%moves = moves
    call at_condition(members%frame, condition, run)
    if (moves) then
      if (present(near)) then
        if (allocated(near%series%cosine)) start = near%series
      end if
      call settle(run, members%setting%model, members%setting%accuracy, motion%frame, error, near=start)
      if (allocated(error)) return
      select type (frame => motion%frame)
      class is (varied_frame_type)
        motion%series = frame%motion
      class default
        next%of_step = of_slope
        next%quick%keeps = allocated(members%perturbed)
        call next_motion(frame, frame, members%setting%accuracy, fewest, next, error)
        if (allocated(error)) return
        motion%series = next%series
        if (next%quickly) motion%quick = next%quick
      end select
    else
      allocate(motion%frame, source=run)
      allocate(motion%series%cosine(0:0, run%dofs()), motion%series%sine(0:0, run%dofs()), source=0.0_dp)
    end if
    n = max(fewest, 8 * ((2 * ubound(motion%series%cosine, 1) + 9) / 8), 8 * ((min(4 * run%least_steps, 4096) + 7) / 8))
    motion%phases = [(real(k, dp) / n, k = 0, n - 1)]
    allocate(motion%q(n, run%dofs(), 0:2))
    call motion%series%values(motion%phases, motion%q(:, :, 0), motion%q(:, :, 1), motion%q(:, :, 2))
  end subroutine solve_motion

  !> Computes the derivatives of a motion with respect to the parameters. `members` must contain the machine with which the motion
  !> was solved, and its neighbours with one parameter changed each. Fails if `find_slopes` fails.
  subroutine solve_slopes(members, motion, error)
    type(members_type), intent(in) :: members
    type(motion_type), intent(inout) :: motion
    type(error_type), allocatable, intent(out) :: error
    type(frame_type) :: run

    allocate(motion%slope(size(motion%phases), size(motion%q, 2), 0:2, size(members%perturbed, 2)), source=0.0_dp)
    if (.not. motion%moves) return
    if (members%setting%model == "exact") then
      call find_slopes(members, motion%frame, motion, error)
    else
      call at_condition(members%frame, motion%condition, run)
      call find_slopes(members, run, motion, error)
    end if
  end subroutine solve_slopes

  !> Computes the derivatives of a motion with respect to the parameters. The matrices M, B, C of `system` are those of the
  !> equations linearised about the motion. Fails if `follow_loads` fails, or if the derivatives overflow.
  subroutine find_slopes(members, system, motion, error)
    type(members_type), intent(in) :: members
    class(frame_type), intent(in) :: system
    type(motion_type), intent(inout) :: motion
    type(error_type), allocatable, intent(out) :: error
    type(coordinates_type) :: coordinates
    real(dp), dimension(motion%parameters()) :: most, lacking, before
    real(dp) :: lack(size(motion%phases), size(motion%q, 2))
    real(dp), allocatable :: loads(:, :, :), changes(:, :, :, :)
    integer :: k, correction
    logical :: fits

    associate (phases => size(motion%phases), f => size(system%free), parameters => motion%parameters())
      call find_coordinates(system, phases, derivative_tolerance(members%setting%accuracy), coordinates, fits, motion%quick)
      allocate(loads(phases, f, parameters), changes(phases, f, 0:2, parameters))
      most = 0
      before = 0
      ! M, B, C contain all derivatives of R, with an exception if a flywheel holds the speed: terms that depend on the whole
      ! motion. These are the motor's torque, a constant moment, and in space the lag of the shaft
      do correction = 1, merge(max_corrections, 1, system%held_by == "flywheel")
        do k = 1, parameters
          call differentiate_equations(members, system, motion, k, lack)
          if (correction > 1) lack = lower_part(lack, merge(phases / 4, 0, system%drive_lags()))
          loads(:, :, k) = -lack(:, system%free)
          lacking(k) = maxval(norm2(lack, dim=1))
        end do
        most = max(most, lacking)
        if (correction > 1 .and. all(lacking <= 10 * of_slope * most)) exit
        ! only rounding errors of the differences remain to be corrected
        if (correction > 2 .and. system%drive_lags() .and. all(lacking > before / 2)) exit
        before = lacking
        if (fits) then
          call respond(system, coordinates, motion%phases, loads, changes)
        else
          call follow_loads(system, members%setting%accuracy, motion%phases, loads, changes, error)
          if (allocated(error)) return
        end if
        motion%slope(:, system%free, :, :) = motion%slope(:, system%free, :, :) + changes
      end do
    end associate
    if (.not. all(abs(motion%slope) <= huge(most))) call fatal_error(error, &
      & "the derivatives of the vibration overflow double precision", failed_computation)
  end subroutine find_slopes

  !> Removes the harmonics above `order` from functions at equidistant phases of the turn, shape (phases, functions). The phases do
  !> not resolve these harmonics, which consist of rounding errors here.
  function lower_part(values, order) result(lower)
    real(dp), intent(in) :: values(:, :)
    integer, intent(in) :: order
    real(dp) :: lower(size(values, 1), size(values, 2))
    real(dp), dimension(size(values, 1), size(values, 2)) :: unused, also_unused
    type(series_type) :: series
    integer :: k

    if (order == 0) then
      lower = spread(sum(values, dim=1) / size(values, 1), 1, size(values, 1))
      return
    end if
    series = series_through(values)
    series%cosine(order + 1:, :) = 0
    series%sine(order + 1:, :) = 0
    call series%values([(real(k, dp) / size(values, 1), k = 0, size(values, 1) - 1)], lower, unused, also_unused)
  end function lower_part

  !> Computes the periodic motions under several loads, like `respond`, but solves the equations for one load at a time. This
  !> works also if free vibrations are too fast for `respond`, or so small that they are lost next to larger ones. Fails if
  !> `solve_floquet` or `solve_periodic` fails.
  subroutine follow_loads(system, accuracy, phases, loads, changes, error)
    class(frame_type), intent(in), target :: system
    type(accuracy_type), intent(in) :: accuracy
    real(dp), intent(in) :: phases(:), loads(:, :, :)
    real(dp), intent(out) :: changes(:, :, 0:, :)
    type(error_type), allocatable, intent(out) :: error
    type(loaded_type) :: loaded
    type(floquet_type) :: floquet
    type(periodic_solution_type) :: start
    real(dp), allocatable :: x(:, :), p(:, :, :), f(:, :)
    integer :: k, l, n

    loaded%states = system%states
    call loaded%inherit(system)
    loaded%inner => system
    n = size(system%free)
    allocate(p(2 * n, 2 * n, size(phases)), f(2 * n, size(phases)))
    associate (unit => system%period / (2 * pi))
      do l = 1, size(loads, 3)
        loaded%force = series_through(loads(:, :, l))
        call solve_floquet(loaded, accuracy, .true., floquet, error)
        if (.not. allocated(error)) call solve_periodic(floquet, start, error)
        if (.not. allocated(error)) call follow(loaded, floquet, start, phases, x, error)
        if (allocated(error)) return
        call loaded%sample(phases, p, f)
        do k = 1, size(phases)
          changes(k, :, 0, l) = x(:n, k)
          changes(k, :, 1, l) = unit * x(n + 1:, k)
          changes(k, :, 2, l) = unit**2 * (matmul(p(n + 1:, :, k), x(:, k)) + f(n + 1:, k))
        end do
      end do
    end associate
  end subroutine follow_loads

  !> Computes the total derivative of the equations with respect to parameter `k` at all phases, by differences between the
  !> machine and its neighbours. This derivative is dR/dp + dR/dq s, where R is the residual of the equations and s the derivative
  !> of the motion as computed so far.
  subroutine differentiate_equations(members, system, motion, k, lack)
    type(members_type), intent(in) :: members
    class(frame_type), intent(in) :: system
    type(motion_type), intent(in) :: motion
    integer, intent(in) :: k
    real(dp), intent(out) :: lack(:, :)
    class(frame_type), allocatable :: frame
    real(dp) :: q(size(motion%phases), size(motion%q, 2), 0:2), r(size(lack, 1), size(lack, 2))
    integer :: i

    lack = 0
    if (abs(members%weight(0, k)) > 0) then
      call compute_equations(system, motion%phases, motion%q, r)
      lack = members%weight(0, k) * r
    end if
    do i = 1, 2
      call get_neighbour(members, system, motion, k, i, frame, q)
      call compute_equations(frame, motion%phases, q, r)
      lack = lack + members%weight(i, k) * r
    end do
  end subroutine differentiate_equations

  !> Returns neighbour number `i` of the machine, in which parameter `k` is changed, and the neighbour's motion q to first order
  !> in the change. If `system` is linearised about its motion, the neighbour is linearised about q.
  subroutine get_neighbour(members, system, motion, k, i, frame, q)
    !> The machine and its neighbours, which differ in one parameter each
    type(members_type), intent(in) :: members
    !> The machine under the operating condition
    class(frame_type), intent(in) :: system
    !> The motion of the machine and its derivatives
    type(motion_type), intent(in) :: motion
    !> Number of the changed parameter, and number of the neighbour for this parameter (1 or 2)
    integer, intent(in) :: k, i
    !> The neighbour of the machine under the operating condition
    class(frame_type), allocatable, intent(out) :: frame
    !> Motion of the neighbour and its derivatives with respect to theta, shape (phases, dofs, 0:2)
    real(dp), intent(out) :: q(:, :, 0:)
    type(frame_type), allocatable :: run
    type(varied_frame_type), allocatable :: varied

    q = motion%q + members%distance(i, k) * motion%slope(:, :, :, k)
    allocate(run)
    call at_condition(members%perturbed(i, k), motion%condition, run)
    select type (system)
    class is (varied_frame_type)
      allocate(varied)
      varied = varied_frame(run, series_through(q(:, :, 0)))
      varied%newton = system%newton
      call move_alloc(varied, frame)
    class default
      call move_alloc(run, frame)
    end select
  end subroutine get_neighbour

  !> Computes the residual R of the frame's equations at a motion q, shape (phases, dofs). The residual of locked degrees of freedom
  !> is zero.
  subroutine compute_equations(frame, phases, q, r)
    class(frame_type), intent(in) :: frame
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), intent(in) :: q(:, :, 0:)
    real(dp), intent(out) :: r(:, :)
    type(varied_frame_type) :: lacking
    real(dp), dimension(size(phases), size(frame%free), size(frame%free)) :: m, b, c
    real(dp) :: h(size(phases), size(frame%free)), unit
    integer :: i, j

    r = 0
    select type (frame)
    class is (varied_frame_type)
      lacking = frame
      lacking%lacking = .true.
      call lacking%sample_second_order(phases, m, b, c, h)
      r(:, frame%free) = -h
    class default
      call frame%sample_second_order(phases, m, b, c, h)
      unit = 2 * pi / frame%period
      do j = 1, size(frame%free)
        r(:, frame%free(j)) = -h(:, j)
        do i = 1, size(frame%free)
          associate (free => frame%free)
            r(:, free(j)) = r(:, free(j)) + m(:, j, i) * unit**2 * q(:, free(i), 2) + b(:, j, i) * unit * q(:, free(i), 1) &
              & + c(:, j, i) * q(:, free(i), 0)
          end associate
        end do
      end do
    end select
  end subroutine compute_equations

  subroutine matrices(self, t, m, b, c)
    class(loaded_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)

    call self%inner%matrices(t, m, b, c)
  end subroutine matrices

  subroutine sample_second_order(self, phases, m, b, c, h)
    class(loaded_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)
    real(dp), dimension(size(phases), size(m, 2)) :: unused, also_unused

    call self%inner%sample_second_order(phases, m, b, c)
    if (present(h)) call self%force%values(phases, h, unused, also_unused)
  end subroutine sample_second_order

  function coupled(self)
    class(loaded_type), intent(in) :: self
    logical, allocatable :: coupled(:, :)

    coupled = self%inner%coupled()
  end function coupled

  logical function conserves(self, chosen)
    class(loaded_type), intent(in) :: self
    integer, intent(in) :: chosen(:)

    conserves = self%inner%conserves(chosen)
  end function conserves

end module gestell_study_design_motion
