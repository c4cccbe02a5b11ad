!> Checks the coefficients of a user's system while the system is solved. A fault is reported early, with the name of the
!> coefficient, instead of after a long computation.
module gestell_api_guarded
  use gestell_base_error, only: error_type, failed_computation, fatal_error, resonance
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_api_roughness, only: describe_roughness, rows, coefficient_names
  use gestell_floquet_choice_survey, only: survey_system, survey_type
  use gestell_math_lapack, only: factorise
  use gestell_math_matrix, only: unit_matrix
  use gestell_math_root_search, only: root_search_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: explain_failure, guard

  !> Records how often a user's system was evaluated and, if it is faulty, why.
  type, public :: watch_type
    !> Number of evaluations so far; evaluating the matrices and the load at one time counts as two evaluations
    integer :: calls = 0
    !> True if the coefficients have already been examined for faults
    logical :: examined = .false.
    !> Message that describes the fault; unallocated if no fault has been found
    character(len=:), allocatable :: reason
  end type watch_type

  type, extends(second_order_system) :: guarded_type
    class(second_order_system), pointer :: inner => null()
    type(watch_type), pointer :: watch => null()
  contains
    procedure :: matrices, load, sample_second_order, coupled => coupled_second_order
  end type guarded_type

  type, extends(periodic_system) :: guarded_first_order_type
    class(periodic_system), pointer :: inner => null()
    type(watch_type), pointer :: watch => null()
  contains
    procedure :: matrix, forcing, sample, coupled => coupled_first_order
  end type guarded_first_order_type

  !> After this many evaluations the coefficients are examined for faults. Fewer evaluations suffice to solve a smooth system,
  !> unless it changes rapidly within the period.
  integer, parameter :: many_calls = 60000
  !> If the phase of a free motion advances by more than this (rad) within the period, the period is probably given in a wrong unit.
  real(dp), parameter :: absurd_advance = 1.0e5_dp
  !> Number of intervals into which the period is divided to search for a singular mass matrix.
  integer, parameter :: mass_points = 512
  !> `no_mass`: the mass matrix counts as singular if its determinant is at most this fraction of the period's largest
  !> determinant. `precision_of_phase`: accuracy of the phase (fraction of the period) at which the determinant changes its sign.
  real(dp), parameter :: no_mass = 1.0e-12_dp, precision_of_phase = 5.0e-10_dp

contains

  !> Makes `guarded` a system that forwards all calls to `system` and records faults in `watch`. `system` and `watch` must exist as
  !> long as `guarded` is used.
  subroutine guard(system, watch, guarded)
    class(periodic_system), intent(in), target :: system
    type(watch_type), intent(inout), target :: watch
    class(periodic_system), allocatable, intent(out) :: guarded
    type(guarded_type), allocatable :: second
    type(guarded_first_order_type), allocatable :: first

    select type (system)
    class is (second_order_system)
      allocate(second)
      second%inner => system
      second%watch => watch
      call move_alloc(second, guarded)
    class default
      allocate(first)
      first%inner => system
      first%watch => watch
      call move_alloc(first, guarded)
    end select
    guarded%states = system%states
    call guarded%inherit(system)
  end subroutine guard

  !> If the user's system is faulty, replaces `error` by a message about the fault. A fault recorded in `watch` becomes the error
  !> even if the computation succeeded.
  subroutine explain_failure(system, watch, error)
    class(periodic_system), intent(in) :: system
    type(watch_type), intent(inout) :: watch
    type(error_type), allocatable, intent(inout) :: error

    if (allocated(error) .and. .not. allocated(watch%reason)) then
      if (error%code /= failed_computation .or. error%cause == resonance) return
      call find_singular_mass(system, watch)
      if (.not. allocated(watch%reason)) call find_absurd_period(system, watch)
    end if
    if (.not. allocated(watch%reason)) return
    if (allocated(error)) deallocate(error)
    call fatal_error(error, watch%reason, failed_computation)
  end subroutine explain_failure

  !> Records a fault if the phase of the fastest free motion advances by more than `absurd_advance` within the period.
  subroutine find_absurd_period(system, watch)
    class(periodic_system), intent(in) :: system
    type(watch_type), intent(inout) :: watch
    type(survey_type) :: survey
    type(error_type), allocatable :: error

    call survey_system(system, survey, error)
    if (allocated(error)) return
    if (.not. survey%fastest > absurd_advance) return
    watch%reason = "the period of " // concise(system%period, 4) // " is too long: within it the phase of the fastest free " &
      & // "motion advances by " // concise(survey%fastest, 2) // " rad (check that the period and the coefficients use the " // &
      &   "same unit of time)"
  end subroutine find_absurd_period

  !> Searches the period for a time at which det M is zero or changes its sign, and records it as a fault.
  subroutine find_singular_mass(system, watch)
    class(periodic_system), intent(in) :: system
    type(watch_type), intent(inout) :: watch
    real(dp), dimension(system%states / 2, system%states / 2) :: m, b, c
    real(dp) :: determinants(0:mass_points), maximum(system%states / 2), phase
    type(root_search_type) :: search
    integer :: k

    select type (system)
    class is (second_order_system)
      ! Rows are divided by their largest elements, because a product of many small masses underflows.
      maximum = 0
      do k = 0, mass_points
        call system%matrices(real(k, dp) / mass_points * system%period, m, b, c)
        maximum = max(maximum, maxval(abs(m), dim=2))
      end do
      maximum = merge(maximum, 1.0_dp, maximum > 0)
      do k = 0, mass_points
        determinants(k) = mass_determinant(system, real(k, dp) / mass_points, maximum)
      end do
      watch%calls = watch%calls + 2 * (mass_points + 1)
      if (.not. all(ieee_is_finite(determinants))) return
      if (.not. maxval(abs(determinants)) > 0) then
        watch%reason = "the mass matrix is singular at all times"
        return
      end if
      phase = -1
      k = minloc(abs(determinants), dim=1) - 1
      if (abs(determinants(k)) <= no_mass * maxval(abs(determinants))) phase = real(k, dp) / mass_points
      do k = 1, mass_points
        if (phase >= 0 .or. determinants(k - 1) * determinants(k) >= 0) cycle
        call search%start(real(k - 1, dp) / mass_points, determinants(k - 1), real(k, dp) / mass_points, determinants(k))
        do while (.not. search%found(precision_of_phase))
          phase = search%next(precision_of_phase)
          watch%calls = watch%calls + 1
          call search%take(phase, mass_determinant(system, phase, maximum))
        end do
        phase = search%root()
      end do
      if (phase >= 0) watch%reason = "the mass matrix is singular at t = " // concise(phase * system%period, 6) // " (" &
        & // concise(phase, 6) // " of the period)"
    end select
  end subroutine find_singular_mass

  !> Determinant of the scaled mass matrix at a phase, computed from LU factors. Row i of the mass matrix is divided by
  !> maximum(i).
  real(dp) function mass_determinant(system, phase, maximum) result(determinant)
    class(second_order_system), intent(in) :: system
    real(dp), intent(in) :: phase, maximum(:)
    real(dp), dimension(system%states / 2, system%states / 2) :: m, b, c
    integer :: pivots(system%states / 2), k
    type(error_type), allocatable :: singular

    call system%matrices(phase * system%period, m, b, c)
    m = m / spread(maximum, 2, size(m, 1))
    call factorise(m, pivots, singular)
    determinant = 1
    do k = 1, size(m, 1)
      determinant = determinant * merge(m(k, k), -m(k, k), pivots(k) == k)
    end do
  end function mass_determinant

  !> Receives evaluated `values` of the coefficients. Records a fault if they are not finite. After many evaluations, examines the
  !> coefficients for three faults: jumps or kinks, a singular mass matrix, and a period in a wrong unit. If a fault has been
  !> recorded, continuing is useless.
  subroutine take(system, watch, phases, values, names)
    class(periodic_system), intent(in) :: system
    type(watch_type), intent(inout) :: watch
    real(dp), intent(in) :: phases(:), values(:, :)
    character(len=*), intent(in) :: names(:)
    integer :: j, k

    do j = 1, size(names)
      do k = 1, size(phases)
        if (ieee_is_finite(values(k, j)) .or. allocated(watch%reason)) cycle
        watch%reason = trim(names(j)) // " is NaN or infinite at t = " // concise(phases(k) * system%period, 6) // " (" &
          & // concise(phases(k), 6) // " of the period)"
      end do
    end do
    if (allocated(watch%reason) .or. watch%examined .or. watch%calls <= many_calls) return
    watch%examined = .true.
    call describe_roughness(system, watch%calls, watch%reason)
    if (.not. allocated(watch%reason)) call find_singular_mass(system, watch)
    if (.not. allocated(watch%reason)) call find_absurd_period(system, watch)
  end subroutine take

  subroutine matrices(self, t, m, b, c)
    class(guarded_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: m(:, :), b(:, :), c(:, :)
    real(dp), dimension(1, size(m, 1), size(m, 1)) :: all_m, all_b, all_c

    call self%sample_second_order([t / self%period], all_m, all_b, all_c)
    m = all_m(1, :, :)
    b = all_b(1, :, :)
    c = all_c(1, :, :)
  end subroutine matrices

  subroutine load(self, t, h)
    class(guarded_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: h(:)

    h = 0
    if (allocated(self%watch%reason)) return
    call self%inner%load(t, h)
    self%watch%calls = self%watch%calls + 1
  end subroutine load

  subroutine sample_second_order(self, phases, m, b, c, h)
    class(guarded_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: phases(:)
    real(dp), contiguous, intent(out) :: m(:, :, :), b(:, :, :), c(:, :, :)
    real(dp), contiguous, intent(out), optional :: h(:, :)

    if (.not. allocated(self%watch%reason)) then
      call self%inner%sample_second_order(phases, m, b, c, h)
      self%watch%calls = self%watch%calls + size(phases) * merge(2, 1, present(h))
      if (present(h)) then
        call take(self%inner, self%watch, phases, reshape([rows(m), rows(b), rows(c), sum(h, dim=2)], [size(phases), 4]), &
          & coefficient_names)
      else
        call take(self%inner, self%watch, phases, reshape([rows(m), rows(b), rows(c)], [size(phases), 3]), coefficient_names(:3))
      end if
    end if
    if (.not. allocated(self%watch%reason)) return
    ! From now on return a trivial system, which is solved quickly.
    m = spread(unit_matrix(size(m, 2)), 1, size(m, 1))
    b = 0
    c = 0
    if (present(h)) h = 0
  end subroutine sample_second_order

  function coupled_second_order(self) result(coupled)
    class(guarded_type), intent(in) :: self
    logical, allocatable :: coupled(:, :)

    allocate(coupled, source=self%inner%coupled())
  end function coupled_second_order

  subroutine matrix(self, t, p)
    class(guarded_first_order_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)
    real(dp) :: all_p(size(p, 1), size(p, 1), 1)

    call self%sample([t / self%period], all_p)
    p = all_p(:, :, 1)
  end subroutine matrix

  subroutine forcing(self, t, f)
    class(guarded_first_order_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: f(:)

    f = 0
    if (allocated(self%watch%reason)) return
    call self%inner%forcing(t, f)
    self%watch%calls = self%watch%calls + 1
  end subroutine forcing

  subroutine sample(self, phases, p, f)
    class(guarded_first_order_type), intent(in) :: self
    real(dp), intent(in) :: phases(:)
    real(dp), intent(out) :: p(:, :, :)
    real(dp), intent(out), optional :: f(:, :)

    if (.not. allocated(self%watch%reason)) then
      call self%inner%sample(phases, p, f)
      self%watch%calls = self%watch%calls + size(phases) * merge(2, 1, present(f))
      if (present(f)) then
        call take(self%inner, self%watch, phases, reshape([sum(sum(p, dim=1), dim=1), sum(f, dim=1)], [size(phases), 2]), &
          & [character(len=24) :: "the matrix P", "the load f"])
      else
        call take(self%inner, self%watch, phases, reshape([sum(sum(p, dim=1), dim=1)], [size(phases), 1]), ["the matrix P"])
      end if
    end if
    if (.not. allocated(self%watch%reason)) return
    p = 0
    if (present(f)) f = 0
  end subroutine sample

  function coupled_first_order(self) result(coupled)
    class(guarded_first_order_type), intent(in) :: self
    logical, allocatable :: coupled(:, :)

    allocate(coupled, source=self%inner%coupled())
  end function coupled_first_order

end module gestell_api_guarded
