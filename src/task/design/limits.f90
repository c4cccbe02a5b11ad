!> Reads the limits of a design from the input. Rejects limits that no machine can meet, and limits that contradict each other.
module gestell_task_design_limits
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_input_namelist_document, only: group_type, has
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: read
  use gestell_output_table_result_units, only: conversion_type, result_units_type
  use gestell_study_design_goal, only: goal_type, machine_goal
  use gestell_study_design_perturbed_members, only: find_members, members_type
  use gestell_system_family, only: family_type
  use gestell_study_measure, only: peak_measure, rms_measure
  use gestell_task_design_keys, only: constraint_keys, limit_keys
  implicit none (type, external)
  private

  public :: read_limit, check_contradictions, check_mass_limits

  !> Rounding error that is allowed in a sum of masses, relative to the mass of the machine.
  real(dp), parameter :: rounding = 1.0e-9_dp

contains

  !> Reads the limit of a group &constraint. Fails if the group gives no limit or more than one, or a limit that no machine can
  !> meet.
  subroutine read_limit(group, units, goal, error)
    type(group_type), intent(in) :: group
    !> Units of the results, in which limits are given
    type(result_units_type), intent(in) :: units
    type(goal_type), intent(inout) :: goal
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: key
    type(conversion_type) :: conversion
    logical :: given(3)
    integer :: sense

    given = [(has(group, trim(limit_keys(sense))), sense = -1, 1)]
    if (.not. any(given)) call input_error(group, "", "needs one of the keys at_most, at_least and equals", error)
    if (count(given) > 1) call input_error(group, "", "has more than one of the keys at_most, at_least and equals: write a " &
      & // "&constraint for each limit", error)
    if (count(given) /= 1) return
    ! limit_keys begins with index -1
    goal%sense = findloc(given, .true., dim=1) - 2
    key = trim(limit_keys(goal%sense))
    call read(group, constraint_keys, key, goal%limit, error)
    conversion = units%conversion(goal%measure%unit)
    goal%limit = conversion%original(goal%limit)
    if (allocated(error) .or. goal%sense < 0) return
    if (goal%offset > 0) then
      if (goal%limit <= -goal%offset) call input_error(group, key, "cannot be met: the whole machine weighs " &
        & // trim(units%amount(goal%offset, 5, "kg")), error)
    else if (goal%limit < 0) then
      call input_error(group, key, "cannot be met: " // trim(goal%name()) // " is never negative", error)
    end if
  end subroutine read_limit

  !> Compares the limits of the same quantity. Fails if a lower limit exceeds an upper limit. A lower limit of the rms is also
  !> compared with an upper limit of the peak, because the peak is never smaller than the rms.
  subroutine check_contradictions(groups, units, goals, error)
    type(group_type), intent(in) :: groups(:)
    !> Units of the results, in which limits are given
    type(result_units_type), intent(in) :: units
    type(goal_type), intent(in) :: goals(:)
    type(error_type), allocatable, intent(out) :: error
    type(conversion_type) :: conversion
    integer :: i, k

    do k = 1, size(goals)
      do i = 1, k - 1
        if (.not. (contradict(goals(i), goals(k)) .or. contradict(goals(k), goals(i)))) cycle
        conversion = units%conversion(goals(i)%measure%unit)
        call input_error(groups(k), trim(limit_keys(goals(k)%sense)), "contradicts line " // text(groups(i)%line) // ": " &
          & // trim(goals(i)%name()) // " " // trim(limit_keys(goals(i)%sense)) // "=" &
          & // concise(conversion%converted(goals(i)%limit), 6), error)
        return
      end do
    end do
  end subroutine check_contradictions

  !> True if the two limits contradict each other: the quantity of `low` must exceed the limit of `high`, but it cannot be larger
  !> than the quantity of `high`.
  pure logical function contradict(low, high)
    type(goal_type), intent(in) :: low, high

    contradict = low%sense <= 0 .and. high%sense >= 0 .and. low%limit > high%limit &
      & .and. low%measure%quantity == high%measure%quantity
    if (.not. contradict .or. .not. low%is_periodic()) return
    contradict = low%measure%kind == high%measure%kind &
      & .or. (low%measure%kind == rms_measure .and. high%measure%kind == peak_measure)
  end function contradict

  !> Compares the limits of the mass with the masses that are possible. Fails if no machine within the ranges meets a limit. Each
  !> parameter contributes to the mass independently of the others, so the extreme masses are found by varying one parameter at a
  !> time.
  subroutine check_mass_limits(groups, units, goals, family, start, ranges, error)
    !> Groups &constraint of the input
    type(group_type), intent(in) :: groups(:)
    !> Units of the results
    type(result_units_type), intent(in) :: units
    !> Goals that belong to the groups, with their limits; one for each group
    type(goal_type), intent(in) :: goals(:)
    !> Family of machines that differ in the design parameters
    class(family_type), intent(in) :: family
    !> `start`: values of the parameters within their ranges, shape (parameters). `ranges`: lower and upper limits of the ranges,
    !> shape (parameters, 2)
    real(dp), intent(in) :: start(:), ranges(:, :)
    type(error_type), allocatable, intent(out) :: error
    type(error_type), allocatable :: failure
    real(dp) :: x(size(start)), mass(0:2), added(2)
    logical :: known
    integer :: g, k, side

    if (.not. any(goals%about == machine_goal .and. goals%offset > 0)) return
    mass(0) = mass_at(start)
    if (.not. known) return
    added = mass(0)
    do k = 1, size(start)
      do side = 1, 2
        x = start
        x(k) = ranges(k, side)
        mass(side) = mass_at(x)
        if (.not. known) return
      end do
      added = added + [minval(mass), maxval(mass)] - mass(0)
    end do
    do g = 1, size(goals)
      if (.not. goals(g)%offset > 0) cycle
      associate (goal => goals(g), reach => added - goals(g)%offset)
        if ((goal%sense < 0 .or. goal%limit >= reach(1) - rounding * mass(0)) .and. (goal%sense > 0 &
          & .or. goal%limit <= reach(2) + rounding * mass(0))) cycle
        call input_error(groups(g), trim(limit_keys(goal%sense)), &
          & "cannot be met: within the ranges of &design, added_mass lies between " // trim(units%amount(reach(1), 5, "kg")) &
          & // " and " // trim(units%amount(reach(2), 5, "kg")), error)
        return
      end associate
    end do

  contains

    !> Total mass (kg) of the machine with the parameters `x`. Sets `known` to false if this machine does not exist.
    real(dp) function mass_at(x)
      real(dp), intent(in) :: x(:)
      type(members_type) :: machine

      mass_at = 0
      call find_members(family, x, machine, known, failure)
      known = known .and. .not. allocated(failure)
      if (known) mass_at = machine%frame%mass + machine%frame%mechanism%mass
    end function mass_at

  end subroutine check_mass_limits

end module gestell_task_design_limits
