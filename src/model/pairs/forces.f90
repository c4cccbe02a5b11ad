!> Forces in the pairs of a linkage at one crank angle, by the balances of force and moment of each body (Newton and Euler).
!>
!> The groups of the joints are solved in reverse order. The bodies of a group carry known forces: inertia, weight, loads, and the
!> reactions of later groups. The unknowns are the forces of the group's pairs. Moments refer to the joint that adds the group.
module gestell_model_pairs_forces
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: solve_small
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_pairs, only: contact, pair_type, pin, shaft, slide, slot, thrust
  use gestell_model_pairs, only: carrier_of, frame_body, on_pin, structure_type
  implicit none (type, external)
  private

  public :: add_force, add_to_pin, clear, new_applied, solve_pairs

  !> Numbers that describe the action at a place: `fx`, `fy`: force along the axes of the linkage. `moment`. `axial`, `transverse`:
  !> force along the body's axis and perpendicular to it; along a guide and perpendicular to it if the body slides there; along a
  !> slot and perpendicular to it for the force in the slot.
  integer, parameter, public :: fx = 1, fy = 2, moment = 3, axial = 4, transverse = 5, components = 5

  !> Known forces at one crank angle, for each source: the last dimension runs from 0, which stands for all sources together.
  !> `on_bodies`: force along x and y (N) and moment about the joint that adds the body (N m), shape (3, bodies, sources).
  !> `on_pins`: force on the pin of each joint (N), shape (2, joints, sources). `body_errors`, `pin_errors`: bounds on the errors
  !> of all sources together, if requested. `relative`: bound on the relative errors of directions and lever arms.
  type, public :: applied_type
    real(dp), allocatable :: on_bodies(:, :, :), on_pins(:, :, :), body_errors(:, :), pin_errors(:, :)
    real(dp) :: relative = 0
    !> True if bounds on the errors of the joint forces are requested
    logical :: bounded = .false.
  end type applied_type

contains

  !> Creates the list of known forces.
  pure subroutine new_applied(structure, sources, bounded, applied)
    type(structure_type), intent(in) :: structure
    !> Number of sources that are distinguished
    integer, intent(in) :: sources
    !> True if bounds on the errors of the joint forces are requested
    logical, intent(in) :: bounded
    type(applied_type), intent(out) :: applied

    associate (bodies => size(structure%bodies), joints => size(structure%groups))
      allocate(applied%on_bodies(3, bodies, 0:sources), applied%body_errors(3, bodies))
      allocate(applied%on_pins(2, joints, 0:sources), applied%pin_errors(2, joints))
    end associate
    applied%bounded = bounded
    call clear(applied)
  end subroutine new_applied

  !> Removes all known forces.
  pure subroutine clear(applied)
    type(applied_type), intent(inout) :: applied

    call set_zero(size(applied%on_bodies), applied%on_bodies)
    call set_zero(size(applied%on_pins), applied%on_pins)
    if (.not. applied%bounded) return
    applied%body_errors = 0
    applied%pin_errors = 0
  end subroutine clear

  !> Sets the numbers of a small array to zero at once: gfortran clears an array with several dimensions column by column.
  pure subroutine set_zero(length, numbers)
    integer, intent(in) :: length
    real(dp), intent(out) :: numbers(length)

    numbers = 0
  end subroutine set_zero

  !> Adds a force (N) at a point (m) and a moment (N m) of a source to the forces on a body; forces on the frame are ignored.
  !> `errors`: bounds on the errors of force and moment.
  pure subroutine add_force(structure, at, body, source, point, force, torque, errors, applied)
    type(structure_type), intent(in) :: structure
    type(point_type), intent(in) :: at(:)
    integer, intent(in) :: body, source
    real(dp), intent(in) :: point(2), force(2), torque, errors(3)
    type(applied_type), intent(inout) :: applied
    real(dp) :: arm(2)

    if (body <= frame_body) return
    associate (reference => at(structure%bodies(body)%joint))
      arm = point - [reference%x%v, reference%y%v]
    end associate
    associate (sums => applied%on_bodies(:, body, source))
      sums = sums + [force, torque + arm(1) * force(2) - arm(2) * force(1)]
    end associate
    if (source > 0 .or. .not. applied%bounded) return
    associate (bounds => applied%body_errors(:, body))
      bounds = bounds + [errors(:2), errors(3) + abs(arm(1)) * (errors(2) + applied%relative * abs(force(2))) &
        & + abs(arm(2)) * (errors(1) + applied%relative * abs(force(1)))]
    end associate
  end subroutine add_force

  !> Adds a force (N) of a source to the forces on the pin of a joint. `errors`: bounds on its errors.
  pure subroutine add_to_pin(joint, source, force, errors, applied)
    integer, intent(in) :: joint, source
    real(dp), intent(in) :: force(2), errors(2)
    type(applied_type), intent(inout) :: applied

    applied%on_pins(:, joint, source) = applied%on_pins(:, joint, source) + force
    if (source == 0 .and. applied%bounded) applied%pin_errors(:, joint) = applied%pin_errors(:, joint) + errors
  end subroutine add_to_pin

  !> Computes the forces at all places. Fails if the linkage is at a dead point.
  subroutine solve_pairs(structure, at, sources, applied, values, bounds, error)
    type(structure_type), intent(in) :: structure
    !> Points of all joints at the crank angle
    type(point_type), intent(in) :: at(:)
    !> Number of sources that are distinguished
    integer, intent(in) :: sources
    !> Known forces. The procedure adds the reactions of the pairs
    type(applied_type), intent(inout) :: applied
    !> `values`: forces and moments on the bodies; the last dimension runs from 0 (all sources together). `bounds`: bounds on the
    !> errors of all sources together; zero unless they are requested
    real(dp), intent(out) :: values(components, size(structure%places), 0:sources), bounds(components, size(structure%places))
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: force(2), errors(3), axis(2)
    integer :: j, k, source

    values = 0
    bounds = 0
    errors = 0
    do j = size(structure%groups), 1, -1
      if (structure%hosts(j) > frame_body) then
        ! the bodies on the pin act on the body of which the pin is a point
        if (applied%bounded) errors(:2) = applied%pin_errors(:, j)
        do source = 0, sources
          force = applied%on_pins(:, j, source)
          call add_force(structure, at, structure%hosts(j), source, place_of(at(j)), force, 0.0_dp, errors, applied)
        end do
        k = structure%host_places(j)
        if (k > 0) then
          values(fx:fy, k, :) = applied%on_pins(:, j, :)
          bounds(fx:fy, k) = errors(:2)
        end if
      end if
      if (size(structure%groups(j)%pairs) > 0) call solve_group(structure, j, at, sources, applied, values, bounds, error)
      if (allocated(error)) return
    end do
    do k = 1, size(structure%places)
      axis = axis_at(structure, k, at)
      do source = 0, sources
        associate (value => values(:, k, source))
          value(axial) = axis(1) * value(fx) + axis(2) * value(fy)
          value(transverse) = axis(1) * value(fy) - axis(2) * value(fx)
        end associate
      end do
      if (applied%bounded) bounds(axial:transverse, k) = sum(bounds(fx:fy, k))
    end do
  end subroutine solve_pairs

  !> Solves the balances of the bodies and of the pin that joint `j` adds, and passes the reactions on to earlier joints.
  subroutine solve_group(structure, j, at, sources, applied, values, bounds, error)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: j, sources
    type(point_type), intent(in) :: at(:)
    type(applied_type), intent(inout) :: applied
    real(dp), intent(inout) :: values(components, size(structure%places), 0:sources), bounds(components, size(structure%places))
    type(error_type), allocatable, intent(out) :: error
    !> A dyad has two bodies and a pin, hence 2 x 3 + 2 equations and as many unknowns
    integer, parameter :: most = 8
    !> `rows`: coefficients of each equation, then its right-hand sides of all sources, and then, for bounds, a row of the unit
    !> matrix, which becomes a row of the inverse. `sizes`: absolute values of the coefficients
    real(dp) :: rows(sources + 1 + merge(2, 1, applied%bounded) * equations(structure, j), equations(structure, j))
    real(dp) :: sizes(most, most), errors(most), bound(most)
    real(dp) :: columns(3, 2, most), action(3), wrong_by(3), second
    logical :: singular, on_guide
    integer :: i, k, n, row, last, unknowns, source, first(most), widths(most), carrier

    associate (group => structure%groups(j))
      n = equations(structure, j)
      last = n + 1 + sources
      call set_zero(size(rows), rows)
      do source = 0, sources
        do k = 1, group%bodies
          rows(n + 1 + source, 3 * k - 2:3 * k) = -applied%on_bodies(:, group%first + k, source)
        end do
        if (structure%hosts(j) == on_pin) rows(n + 1 + source, n - 1:n) = -applied%on_pins(:, j, source)
      end do
      unknowns = 0
      do k = 1, size(group%pairs)
        first(k) = unknowns + 1
        call find_columns(group%pairs(k), at, j, columns(:, :, k), widths(k))
        do i = 1, widths(k)
          unknowns = unknowns + 1
          row = 3 * group%pairs(k)%body
          rows(unknowns, row - 2:row) = columns(:, i, k)
          if (group%pairs(k)%kind == slot) then
            row = 3 * group%pairs(k)%against
            rows(unknowns, row - 2:row) = -columns(:, i, k)
          end if
          ! the pin feels the opposite of the forces on the bodies
          if (group%pairs(k)%kind == pin .and. group%pairs(k)%joint == j) rows(unknowns, 3 * group%bodies + i) = -1
        end do
      end do
      if (applied%bounded) then
        do k = 1, group%bodies
          errors(3 * k - 2:3 * k) = applied%body_errors(:, group%first + k)
        end do
        if (structure%hosts(j) == on_pin) errors(n - 1:n) = applied%pin_errors(:, j)
        sizes(:n, :n) = abs(rows(:n, :))
        do i = 1, n
          rows(last + i, i) = 1
        end do
      end if
      call solve_small(rows, singular)
      if (singular) then
        call fatal_error(error, "the forces at a joint are not determined at a dead point", failed_computation)
        return
      end if
      if (applied%bounded) then
        do i = 1, n
          errors(i) = errors(i) + applied%relative * dot_product(sizes(:n, i), abs(rows(n + 1, :)))
        end do
        bound(:n) = [(dot_product(abs(rows(last + 1:, i)), errors(:n)), i = 1, n)]
      end if
      wrong_by = 0
      do k = 1, size(group%pairs)
        associate (pair => group%pairs(k), from => first(k))
          on_guide = any(pair%kind == [slide, contact, thrust])
          carrier = frame_body
          if (on_guide) carrier = carrier_of(structure, pair%guide)
          if (applied%bounded) then
            second = 0
            if (widths(k) == 2) second = bound(from + 1)
            wrong_by = abs(columns(:, 1, k)) * bound(from) + abs(columns(:, 2, k)) * second
            if (pair%kind == pin) wrong_by(3) = 0
            if (pair%kind == slot) wrong_by(3) = second
            if (pair%kind == shaft) bounds(moment, group%places(1)) = wrong_by(3)
            if (pair%kind /= shaft) bounds(:moment, group%places(k)) = wrong_by
          end if
          do source = 0, sources
            second = 0
            if (widths(k) == 2) second = rows(n + 1 + source, from + 1)
            action = columns(:, 1, k) * rows(n + 1 + source, from) + columns(:, 2, k) * second
            ! moments of the actions about the joint at which they act
            select case (pair%kind)
            case (shaft)
              values(moment, group%places(1), source) = action(3)
              cycle
            case (pin)
              action(3) = 0
            case (slot)
              action = [-action(:2), -second]
            case default
            end select
            values(:moment, group%places(k), source) = action
            if (pair%kind == slot) cycle
            if (on_guide) then
              call add_force(structure, at, carrier, source, place_of(at(j)), -action(:2), -action(3), wrong_by, applied)
            else if (pair%joint /= j) then
              call add_to_pin(pair%joint, source, -action(:2), wrong_by(:2), applied)
            end if
          end do
        end associate
      end do
    end associate
  end subroutine solve_group

  !> Number of balances of the bodies and of the pin that joint `j` adds.
  pure integer function equations(structure, j)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: j

    equations = 3 * structure%groups(j)%bodies
    if (structure%hosts(j) == on_pin) equations = equations + 2
  end function equations

  !> Forces along x and y and moment about joint `j` of the unit unknowns of a pair on its body, in the first `n` columns.
  pure subroutine find_columns(pair, at, j, columns, n)
    type(pair_type), intent(in) :: pair
    type(point_type), intent(in) :: at(:)
    integer, intent(in) :: j
    real(dp), intent(out) :: columns(3, 2)
    integer, intent(out) :: n
    type(point_type) :: origin, along
    real(dp) :: normal(2), arm(2)

    columns = 0
    n = 1
    arm = place_of(at(pair%joint)) - place_of(at(j))
    select case (pair%kind)
    case (pin)
      n = 2
      columns(:, 1) = [1.0_dp, 0.0_dp, -arm(2)]
      columns(:, 2) = [0.0_dp, 1.0_dp, arm(1)]
    case (shaft)
      columns(3, 1) = 1
    case (contact)
      normal = normal_of(pair, at)
      columns(:2, 1) = normal
    case (thrust)
      call pair%guide%line(at, origin, along)
      columns(:2, 1) = [along%x%v, along%y%v]
    case default ! slide, slot
      call pair%guide%line(at, origin, along)
      normal = [-along%y%v, along%x%v]
      columns(:, 1) = [normal, arm(1) * normal(2) - arm(2) * normal(1)]
      n = 2
      columns(3, 2) = 1
    end select
  end subroutine find_columns

  !> Common normal of a cam and the roller of its follower: perpendicular to the velocity of the roller's centre relative to the
  !> cam.
  pure function normal_of(pair, at) result(normal)
    type(pair_type), intent(in) :: pair
    type(point_type), intent(in) :: at(:)
    real(dp) :: normal(2)
    type(point_type) :: origin, along
    real(dp) :: arm(2), rate

    call pair%guide%line(at, origin, along)
    rate = along%x%v * along%y%d - along%y%v * along%x%d
    associate (here => at(pair%joint))
      arm = [here%x%v - origin%x%v, here%y%v - origin%y%v]
      normal = [-(here%y%d - origin%y%d - rate * arm(1)), here%x%d - origin%x%d + rate * arm(2)]
    end associate
    normal = normal / norm2(normal)
  end function normal_of

  !> Axis along which the force at place `k` is resolved: that of its body, or the guide or slot of a sliding body.
  pure function axis_at(structure, k, at) result(axis)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: k
    type(point_type), intent(in) :: at(:)
    real(dp) :: axis(2)
    type(point_type) :: origin, along

    associate (place => structure%places(k), body => structure%bodies(structure%places(k)%body))
      if (place%kind == slot) then
        call structure%bodies(place%other)%slot%line(at, origin, along)
        axis = place_of(along)
      else if (allocated(body%guide)) then
        call body%guide%line(at, origin, along)
        axis = place_of(along)
      else if (all(body%axis > 0)) then
        axis = place_of(at(body%axis(2))) - place_of(at(body%axis(1)))
        axis = axis / sqrt(axis(1)**2 + axis(2)**2)
      else
        call body%slot%line(at, origin, along)
        axis = place_of(along)
      end if
    end associate
  end function axis_at

  !> Position of a point (m).
  pure function place_of(point)
    type(point_type), intent(in) :: point
    real(dp) :: place_of(2)

    place_of = [point%x%v, point%y%v]
  end function place_of

end module gestell_model_pairs_forces
