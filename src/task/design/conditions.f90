!> Reads the operating conditions of a design: each speed of the sweep combined with the tolerances in &robust. Defines the lines
!> along which worse conditions between these combinations are sought.
module gestell_task_design_conditions
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_input_namelist_document, only: count_groups, group_type, group_named
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: read
  use gestell_input_wording, only: lower
  use gestell_math_sorting, only: ascending
  use gestell_study_design_perturbed_members, only: along_speed, along_stiffness, condition_type
  use gestell_task_common_configuration, only: configuration_type, read_plan
  use gestell_task_design_keys, only: robust_keys
  use gestell_task_design_range, only: range_line_type
  implicit none (type, external)
  private

  public :: read_conditions

contains

  !> Reads the operating conditions. Fails if a value is out of range, or if the speed is varied by the sweep and is also a design
  !> parameter.
  subroutine read_conditions(configuration, paths, conditions, lines, robust, error)
    type(configuration_type), intent(inout) :: configuration
    !> Paths in the input of all numbers that the design changes, for example "frame.mass"
    character(len=*), intent(in) :: paths(:)
    !> All combinations of the given speeds with the factors on speed, stiffness and damping
    type(condition_type), allocatable, intent(out) :: conditions(:)
    !> Lines through the range of conditions, along which the worst conditions are sought
    type(range_line_type), allocatable, intent(out) :: lines(:)
    !> True if &robust gives a tolerance for speed, stiffness or damping
    logical, intent(out) :: robust
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    real(dp), allocatable :: speeds(:), of_speed(:), of_stiffness(:), of_damping(:)
    real(dp) :: scatter(3)
    integer :: i, j, k, s

    robust = .false.
    speeds = [0.0_dp]
    if (all(lower(paths) /= "drive.speed_rpm")) speeds = [configuration%frame%speed]
    if (count_groups(configuration%document, "sweep") > 0) then
      if (any(lower(paths) == "drive.speed_rpm")) then
        call input_error(group_named(configuration%document, "sweep"), "parameter", "the speed cannot vary in &sweep, " &
          & // "since &design changes it", error)
        return
      end if
      if (.not. allocated(configuration%plan)) call read_plan(configuration, .true., error)
      if (allocated(error)) return
      speeds = configuration%speeds() * pi / 30 / configuration%turns()
    end if
    group = group_named(configuration%document, "robust")
    call read(group, robust_keys, "speed_percent", scatter(1), error)
    if (.not. allocated(error)) call read(group, robust_keys, "mounting_percent", scatter(2), error)
    if (.not. allocated(error)) call read(group, robust_keys, "damping_percent", scatter(3), error)
    if (allocated(error)) return
    scatter = scatter / 100
    robust = any(scatter > 0)
    of_speed = factors_within(scatter(1))
    of_stiffness = factors_within(scatter(2))
    of_damping = factors_within(scatter(3))
    conditions = [((((condition_type(speeds(s), of_speed(i), of_stiffness(j), of_damping(k)), i = 1, size(of_speed)), &
      & j = 1, size(of_stiffness)), k = 1, size(of_damping)), s = 1, size(speeds))]
    call build_lines(conditions, of_stiffness, of_damping, lines)
  end subroutine read_conditions

  !> Factors by which a number with the relative tolerance `scatter` is multiplied: lower limit, 1 and upper limit. If the
  !> tolerance is zero, the factor 1 is the only element.
  pure function factors_within(scatter) result(factors)
    real(dp), intent(in) :: scatter
    real(dp), allocatable :: factors(:)

    factors = [1.0_dp]
    if (scatter > 0) factors = [1 - scatter, 1.0_dp, 1 + scatter]
  end function factors_within

  !> Defines the lines along which designs are examined. One line of varying speed belongs to each combination of stiffness and
  !> damping factors. Lines of varying stiffness lie at the lowest and at the highest speed, one for each damping factor.
  subroutine build_lines(conditions, of_stiffness, of_damping, lines)
    type(condition_type), intent(in) :: conditions(:)
    !> Factors by which the stiffness and the damping of the mounts are multiplied
    real(dp), intent(in) :: of_stiffness(:), of_damping(:)
    type(range_line_type), allocatable, intent(out) :: lines(:)
    type(condition_type) :: start
    real(dp), allocatable :: speeds(:), ends(:)
    integer :: j, k, e

    allocate(lines(0))
    start%speed = conditions(1)%speed
    speeds = conditions%speed * conditions%speed_factor
    if (.not. abs(start%speed) > 0) speeds = conditions%speed_factor
    speeds = without_repeats(speeds(ascending(abs(speeds))))
    if (size(speeds) > 1) then
      do k = 1, size(of_damping)
        start%damping_factor = of_damping(k)
        do j = 1, size(of_stiffness)
          start%stiffness_factor = of_stiffness(j)
          lines = [lines, range_line_type(start, speeds)]
        end do
      end do
    end if
    if (size(of_stiffness) == 1) return
    ends = without_repeats([speeds(1), speeds(size(speeds))])
    do k = 1, size(of_damping)
      start%damping_factor = of_damping(k)
      do e = 1, size(ends)
        start%along = along_speed
        start = start%moved_to(ends(e))
        start%along = along_stiffness
        lines = [lines, range_line_type(start, of_stiffness)]
      end do
    end do
  end subroutine build_lines

  !> The values of an ascending list, each only once.
  pure function without_repeats(list) result(distinct)
    real(dp), intent(in) :: list(:)
    real(dp), allocatable :: distinct(:)
    real(dp), parameter :: same = 1.0e-12_dp

    distinct = pack(list, [.true., abs(list(2:) - list(:size(list) - 1)) > same * abs(list(2:))])
  end function without_repeats

end module gestell_task_design_conditions
