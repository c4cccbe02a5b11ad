!> Solves one point of a sweep directly, without an expansion.
module gestell_study_point
  use gestell_base_error, only: error_type, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_verdict, only: failed_number, verdict_type
  use gestell_floquet_period_monodromy, only: accuracy_type
  use gestell_floquet_multipliers, only: multipliers_type
  use gestell_model_quantity_rows, only: probe_type
  use gestell_system_family, only: family_type
  use gestell_study_measure, only: measure_type, solve_measures
  use gestell_study_member, only: member_type
  use gestell_study_tile_results, only: last_peak, log_rho_max, rho_error, rho_max, sweep_columns, verdict, xi_peak
  use gestell_study_vibration, only: vibration_type
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  implicit none (type, external)
  private

  public :: peak_limit, solve_point

  !> Options of a sweep: which results to compute at every point, and how.
  type, public :: sweep_options
    type(accuracy_type) :: accuracy
    !> True for each requested column. By default all columns that apply to a frame in the plane
    logical :: columns(sweep_columns) = [.true., .true., .true., .true., .true., .true., .true., .false., .false., .false.]
    !> True if the verdict comes after the peaks in the table. This is the case if the input requests peaks but no verdict
    logical :: verdict_last = .false.
    !> Measures of the vibration. Each is written with its error bound, after the requested columns
    type(measure_type), allocatable :: measures(:)
    !> Probes to which the measures refer
    type(probe_type), allocatable :: probes(:)
    !> Method with which points are solved: 'auto', 'expansion' or 'direct'
    character(len=9) :: engine = "auto"
    !> Model of the frame that is used at every point (gestell_study_frame_model)
    character(len=11) :: model = "exact"
    !> True if the input lists columns; pictures then show all of these columns
    logical :: names_columns = .false.
  contains
    procedure :: ordered, measured, one_by_one, numbers
  end type sweep_options

contains

  !> Indices of the requested columns, in the order in which the file lists them.
  pure function ordered(self) result(columns)
    class(sweep_options), intent(in) :: self
    integer :: columns(count(self%columns))
    integer :: k

    columns = pack([(k, k = 1, sweep_columns)], self%columns)
    if (self%verdict_last) columns = [pack(columns, columns /= verdict), verdict]
  end function ordered

  !> Number of requested measures.
  pure integer function measured(self)
    class(sweep_options), intent(in) :: self

    measured = 0
    if (allocated(self%measures)) measured = size(self%measures)
  end function measured

  !> True if every point must be solved directly. This is so in four cases: `engine` is 'direct', the number of steps is given, the
  !> model is averaged, or measures are requested.
  pure logical function one_by_one(self)
    class(sweep_options), intent(in) :: self

    one_by_one = self%engine == "direct" .or. self%accuracy%steps > 0 .or. self%model == "averaged" .or. self%measured() > 0
  end function one_by_one

  !> Number of values that are reported for each point.
  pure integer function numbers(self)
    class(sweep_options), intent(in) :: self

    numbers = count(self%columns) + 2 * self%measured()
  end function numbers

  !> Computes all columns of one point. Columns that are not requested or have no value are NaN. Fails if the parameters or a
  !> measure are invalid. Other failures are recorded as the verdict.
  subroutine solve_point(family, parameters, options, values, error, measures)
    !> The family to which the machines of the sweep belong
    class(family_type), intent(in) :: family
    real(dp), intent(in) :: parameters(:)
    type(sweep_options), intent(in) :: options
    !> Values of all columns for this point
    real(dp), intent(out) :: values(sweep_columns)
    type(error_type), allocatable, intent(out) :: error
    !> Each measure and a bound on its error, shape (2, measures)
    real(dp), intent(out), optional :: measures(:, :)
    type(member_type) :: member
    type(multipliers_type) :: multipliers
    type(verdict_type) :: judged
    logical :: forced, judges

    values = ieee_value(1.0_dp, ieee_quiet_nan)
    if (present(measures)) measures = ieee_value(1.0_dp, ieee_quiet_nan)
    forced = any(options%columns(xi_peak:last_peak)) .or. options%measured() > 0
    judges = any(options%columns([rho_max, log_rho_max, rho_error, verdict]))
    call member%make(family, parameters, error)
    if (.not. allocated(error)) call member%solve(options%accuracy, forced, error)
    if (judges .and. .not. allocated(error)) call member%multipliers(.false., multipliers, error)
    values(verdict) = failed_number
    if (allocated(error)) return
    if (.not. member%is_sound()) then
      values(verdict) = member%state%number()
      return
    end if
    if (judges) then
      values(rho_max) = abs(multipliers%rho(1))
      values(log_rho_max) = multipliers%log_abs(1)
      values(rho_error) = multipliers%error(1)
      judged = multipliers%judge()
      values(verdict) = judged%number()
    end if
    if (forced) call set_vibration(member, options, values, error, measures)
  end subroutine solve_point

  !> Maximum accepted relative error of a vibration that is computed by an expansion, in units that make the states comparable. It
  !> is larger than the tolerance, because near a resonance the error of the vibration is many times that of the monodromy matrix.
  pure real(dp) function peak_limit(options)
    type(sweep_options), intent(in) :: options

    peak_limit = 1000 * options%accuracy%tolerance
  end function peak_limit

  !> Computes the peaks of the frame's vibration and the measures. They stay NaN at a resonance and for systems that are not frames.
  !> Fails if a measure is invalid.
  subroutine set_vibration(member, options, values, error, measures)
    type(member_type), intent(in) :: member
    type(sweep_options), intent(in) :: options
    real(dp), intent(inout) :: values(sweep_columns)
    type(error_type), allocatable, intent(out) :: error
    real(dp), intent(inout), optional :: measures(:, :)
    type(vibration_type) :: vibration
    type(measure_type), allocatable :: requested(:)
    type(probe_type), allocatable :: probes(:)
    real(dp) :: computed(2, options%measured())

    allocate(requested(0), probes(0))
    if (present(measures) .and. allocated(options%measures)) requested = options%measures
    if (allocated(options%probes)) probes = options%probes
    call solve_measures(member%system, member%floquet, probes, requested, vibration, computed(:, :size(requested)), error)
    if (allocated(error)) then
      if (error%code /= invalid_input .or. size(requested) == 0) deallocate(error)
      return
    end if
    values(xi_peak:xi_peak - 1 + size(vibration%peak) / 3) = vibration%peak(:size(vibration%peak) / 3)
    if (size(requested) > 0) measures = computed
  end subroutine set_vibration

end module gestell_study_point
