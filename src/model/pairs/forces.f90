!> Forces in the pairs of a linkage at one crank angle, by the balances of force and moment of each body (Newton and Euler).
!>
!> The groups of the joints are solved in reverse order. The bodies of a group carry known forces: inertia, weight, loads, and the
!> reactions of later groups. The unknowns are the forces of the group's pairs. Moments refer to the joint that adds the group.
module gestell_model_pairs_forces
  use gestell_base_error, only: error_type, failed_computation, fatal_error
  use gestell_base_kinds, only: dp
  use gestell_math_matrix, only: solve_small, unit_matrix
  use gestell_model_joints_joint, only: point_type
  use gestell_model_joints_pairs, only: contact, pair_type, pin, shaft, slide, slot, thrust
  use gestell_model_joints_path, only: direction
  use gestell_model_pairs, only: carrier_of, frame_body, on_pin, structure_type
  implicit none (type, external)
  private

  public :: add_force, new_applied, solve_pairs

  !> Numbers that describe the action at a place: `fx`, `fy`: force along the axes of the linkage. `moment`. `axial`, `transverse`:
  !> force along the body's axis and perpendicular to it, or along a slider's guide and perpendicular to it.
  integer, parameter, public :: fx = 1, fy = 2, moment = 3, axial = 4, transverse = 5, components = 5

  !> Known forces at one crank angle. `on_bodies`: force along x and y (N) and moment about the joint that adds the body (N m),
  !> shape (3, bodies). `on_pins`: force on the pin of each joint (N), shape (2, joints). `body_errors`, `pin_errors`: bounds on
  !> their errors. `relative`: bound on the relative errors of directions and lever arms.
  type, public :: applied_type
    real(dp), allocatable :: on_bodies(:, :), on_pins(:, :), body_errors(:, :), pin_errors(:, :)
    real(dp) :: relative = 0
    !> True if bounds on the errors of the joint forces are requested
    logical :: bounded = .false.
  end type applied_type

contains

  !> Creates the list of known forces without any force.
  pure subroutine new_applied(structure, applied)
    type(structure_type), intent(in) :: structure
    type(applied_type), intent(out) :: applied

    allocate(applied%on_bodies(3, size(structure%bodies)), applied%on_pins(2, size(structure%groups)), source=0.0_dp)
    applied%body_errors = applied%on_bodies
    applied%pin_errors = applied%on_pins
  end subroutine new_applied

  !> Adds a force (N) at a point (m) and a moment (N m) to the forces on a body; forces on the frame are ignored. `errors`: bounds
  !> on the errors of force and moment.
  pure subroutine add_force(structure, at, body, point, force, torque, applied, errors)
    type(structure_type), intent(in) :: structure
    type(point_type), intent(in) :: at(:)
    integer, intent(in) :: body
    real(dp), intent(in) :: point(2), force(2), torque
    type(applied_type), intent(inout) :: applied
    real(dp), intent(in) :: errors(3)
    real(dp) :: arm(2)

    if (body <= frame_body) return
    associate (reference => at(structure%bodies(body)%joint))
      arm = point - [reference%x%v, reference%y%v]
    end associate
    associate (sums => applied%on_bodies(:, body), bounds => applied%body_errors(:, body))
      sums = sums + [force, torque + arm(1) * force(2) - arm(2) * force(1)]
      bounds = bounds + [errors(:2), errors(3) + abs(arm(1)) * (errors(2) + applied%relative * abs(force(2))) &
        & + abs(arm(2)) * (errors(1) + applied%relative * abs(force(1)))]
    end associate
  end subroutine add_force

  !> Computes the forces at all places. Fails if the linkage is at a dead point.
  subroutine solve_pairs(structure, at, applied, values, bounds, error)
    type(structure_type), intent(in) :: structure
    !> Points of all joints at the crank angle
    type(point_type), intent(in) :: at(:)
    !> Known forces. The procedure adds the reactions of the pairs
    type(applied_type), intent(inout) :: applied
    !> Forces and moments on the bodies and bounds on their errors, shape (components, places)
    real(dp), intent(out) :: values(:, :), bounds(:, :)
    type(error_type), allocatable, intent(out) :: error
    integer :: j, k

    values = 0
    bounds = 0
    do j = size(structure%groups), 1, -1
      if (structure%hosts(j) > frame_body) then
        ! the bodies on the pin act on the body of which the pin is a point
        call add_force(structure, at, structure%hosts(j), place_of(at(j)), applied%on_pins(:, j), 0.0_dp, applied, &
          & [applied%pin_errors(:, j), 0.0_dp])
        k = structure%host_places(j)
        if (k > 0) then
          values(fx:fy, k) = applied%on_pins(:, j)
          bounds(fx:fy, k) = applied%pin_errors(:, j)
        end if
      end if
      if (size(structure%groups(j)%pairs) > 0) call solve_group(structure, j, at, applied, values, bounds, error)
      if (allocated(error)) return
    end do
    do k = 1, size(structure%places)
      call resolve(structure, k, at, values(:, k), bounds(:, k))
    end do
  end subroutine solve_pairs

  !> Solves the balances of the bodies and of the pin that joint `j` adds, and passes the reactions on to earlier joints.
  subroutine solve_group(structure, j, at, applied, values, bounds, error)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: j
    type(point_type), intent(in) :: at(:)
    type(applied_type), intent(inout) :: applied
    real(dp), intent(inout) :: values(:, :), bounds(:, :)
    type(error_type), allocatable, intent(out) :: error
    !> A dyad has two bodies and a pin, hence 2 x 3 + 2 equations
    integer, parameter :: most = 8
    real(dp) :: a(most, most), known(most), errors(most), x(most), bound(most), columns(3, 2), action(3), wrong_by(3)
    real(dp) :: sides(most, most + 1)
    real(dp), allocatable :: sizes(:, :)
    logical :: singular
    integer :: k, n, row, equations, unknowns, first(most)

    associate (group => structure%groups(j))
      a = 0
      known = 0
      errors = 0
      equations = 3 * group%bodies
      do k = 1, group%bodies
        known(3 * k - 2:3 * k) = applied%on_bodies(:, group%first + k)
        errors(3 * k - 2:3 * k) = applied%body_errors(:, group%first + k)
      end do
      if (structure%hosts(j) == on_pin) then
        known(equations + 1:equations + 2) = applied%on_pins(:, j)
        errors(equations + 1:equations + 2) = applied%pin_errors(:, j)
      end if
      unknowns = 0
      do k = 1, size(group%pairs)
        call find_columns(group%pairs(k), at, j, columns, n)
        row = 3 * group%pairs(k)%body - 2
        first(k) = unknowns + 1
        a(row:row + 2, unknowns + 1:unknowns + n) = columns(:, :n)
        if (group%pairs(k)%kind == slot) then
          row = 3 * group%pairs(k)%against - 2
          a(row:row + 2, unknowns + 1:unknowns + n) = -columns(:, :n)
        end if
        ! the pin feels the opposite of the forces on the bodies
        if (group%pairs(k)%kind == pin .and. group%pairs(k)%joint == j) a(equations + 1:equations + 2, unknowns + 1:unknowns + 2) &
          & = reshape([-1, 0, 0, -1], [2, 2])
        unknowns = unknowns + n
      end do
      associate (a => a(:unknowns, :unknowns))
        if (applied%bounded) then
          sides(:unknowns, 2:unknowns + 1) = unit_matrix(unknowns)
          sizes = abs(a)
        end if
        sides(:unknowns, 1) = -known(:unknowns)
        call solve_small(a, sides(:unknowns, :merge(unknowns + 1, 1, applied%bounded)), singular)
        x(:unknowns) = sides(:unknowns, 1)
        bound = 0
        if (applied%bounded) bound(:unknowns) = matmul(abs(sides(:unknowns, 2:unknowns + 1)), errors(:unknowns) &
          & + applied%relative * matmul(sizes, abs(x(:unknowns))))
      end associate
      if (singular) then
        call fatal_error(error, "the forces at a joint are not determined at a dead point", failed_computation)
        return
      end if
      do k = 1, size(group%pairs)
        associate (pair => group%pairs(k))
          call find_columns(pair, at, j, columns, n)
          associate (from => first(k), to => first(k) + n - 1)
            action = matmul(columns(:, :n), x(from:to))
            wrong_by = matmul(abs(columns(:, :n)), bound(from:to))
          end associate
          ! moments of the actions about the joint at which they act
          if (pair%kind == pin) action(3) = 0
          if (pair%kind == pin) wrong_by(3) = 0
          if (pair%kind == slot) then
            action = [-action(:2), -x(first(k) + 1)]
            wrong_by(3) = bound(first(k) + 1)
          end if
          if (pair%kind == shaft) then
            values(moment, group%places(1)) = action(3)
            bounds(moment, group%places(1)) = wrong_by(3)
            cycle
          end if
          values(:moment, group%places(k)) = action
          bounds(:moment, group%places(k)) = wrong_by
          if (pair%kind == slot) cycle
          if (any(pair%kind == [slide, contact, thrust])) then
            call add_force(structure, at, carrier_of(structure, pair%guide), place_of(at(j)), -action(:2), -action(3), applied, &
              & wrong_by)
          else if (pair%joint /= j) then
            applied%on_pins(:, pair%joint) = applied%on_pins(:, pair%joint) - action(:2)
            applied%pin_errors(:, pair%joint) = applied%pin_errors(:, pair%joint) + wrong_by(:2)
          end if
        end associate
      end do
    end associate
  end subroutine solve_group

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

  !> Resolves the force at place `k` along the axis of its body, or along the guide of a slider.
  pure subroutine resolve(structure, k, at, values, bounds)
    type(structure_type), intent(in) :: structure
    integer, intent(in) :: k
    type(point_type), intent(in) :: at(:)
    real(dp), intent(inout) :: values(:), bounds(:)
    type(point_type) :: origin, along

    associate (body => structure%bodies(structure%places(k)%body))
      if (allocated(body%guide)) then
        call body%guide%line(at, origin, along)
      else
        along = direction(at(body%axis(1)), at(body%axis(2)))
      end if
    end associate
    values(axial) = along%x%v * values(fx) + along%y%v * values(fy)
    values(transverse) = along%x%v * values(fy) - along%y%v * values(fx)
    bounds(axial:transverse) = sum(bounds(fx:fy))
  end subroutine resolve

  !> Position of a point (m).
  pure function place_of(point)
    type(point_type), intent(in) :: point
    real(dp) :: place_of(2)

    place_of = [point%x%v, point%y%v]
  end function place_of

end module gestell_model_pairs_forces
