!> Quantities that are linear in the motion of a frame in the plane or in space: displacements, velocities and accelerations of the
!> frame and of its points, and forces on the ground. Each quantity is a weighted sum of the rows of the motion
!> (gestell_model_quantity_rows).
module gestell_model_quantity
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text, whole_number
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_math_rotation, only: cross
  use gestell_model_mounting, only: damping_matrix, is_rotation, load_rounding, matrix_rounding, stiffness_matrix, turned_loads
  use gestell_model_quantity_joint_quantities, only: find_joint_force
  use gestell_model_quantity_rows, only: accelerations, exact_rows, excess_of_point, excess_row, force_names, ground_forces_type, &
    & is_of_probe, moment_rows, new_ground_forces, probe_type, quantity_type, rotations_of, rows_of, shifts_of, support_rows
  implicit none (type, external)
  private

  public :: find_quantity, look_up_quantity, parts_of_point, point_quantity

  !> Components of a probe's motion. Displacement: x, y, z and the magnitude d of the vector. Velocity and acceleration follow in
  !> the same arrangement.
  character(len=2), parameter, public :: point_parts(12) = [character(len=2) :: "x", "y", "z", "d", "vx", "vy", "vz", "v", &
    & "ax", "ay", "az", "a"]
  !> Positions of the component along z, and of the magnitude, in each group of four components.
  integer, parameter :: z = 3, whole = 4
  character(len=*), parameter :: point_units(0:2) = [character(len=5) :: "m", "m/s", "m/s^2"]
  character(len=*), parameter :: turn_units(0:2) = [character(len=7) :: "rad", "rad/s", "rad/s^2"]
  character(len=*), parameter :: rates(0:2) = [character(len=5) :: "", "_dot", "_ddot"]

contains

  !> Finds the quantity with the given name, one of:
  !>   xi, eta, psi, in space also zeta, rot_xi, rot_eta; each also with _dot, _ddot for its rate and acceleration;
  !>   PART.fx, PART.fy, PART.f for forces on the ground and PART.m for their moment, in space also .fz, .mx, .my;
  !>   joint(NAME).fx, .fy, .f for forces in pairs, and .m, .n, .axial, .transverse (gestell_model_quantity_joint_quantities);
  !>   probe(NAME).x, .y, .d, .vx, .vy, .v, .ax, .ay, .a, in space also .z, .vz, .az.
  !> PART is foundation, guide, total, or a support such as support(2), which has no moments. Without "PART." the name means
  !> supports and foundation together; only f means total.f. Fails if there is no quantity with this name, or if the frame's `check`
  !> fails.
  subroutine find_quantity(frame, probes, name, quantity, error)
    class(frame_type), intent(in) :: frame
    !> Probes (measuring points) to which the name may refer
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(quantity_type), intent(out) :: quantity
    type(error_type), allocatable, intent(out) :: error

    call frame%check(error)
    if (.not. allocated(error)) call look_up_quantity(frame, probes, name, quantity, error)
  end subroutine find_quantity

  !> Finds the quantity with the given name, like `find_quantity`, but without checking the frame. Fails if there is no quantity
  !> with this name.
  subroutine look_up_quantity(frame, probes, name, quantity, error)
    class(frame_type), intent(in) :: frame
    !> Probes (measuring points) to which the name may refer
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(quantity_type), intent(out) :: quantity
    type(error_type), allocatable, intent(out) :: error
    integer :: dot, k

    dot = index(name, ".", back=.true.)
    if (index(name, ")", back=.true.) > dot) dot = 0
    if (dot == 0 .and. name == "f") then
      call find_force(frame, "total", name, quantity)
    else if (dot == 0) then
      call find_coordinate(frame, name, quantity)
      if (.not. allocated(quantity%weights)) call find_force(frame, "", name, quantity)
    else if (index(name, "probe(") == 1) then
      do k = 1, size(probes)
        if (.not. is_of_probe(name(:dot - 1), probes(k))) cycle
        call point_quantity(frame, probes(k), name(dot + 1:), quantity)
      end do
    else if (index(name, "joint(") == 1 .and. dot > len("joint()")) then
      call find_joint_force(frame, name(7:dot - 2), name(dot + 1:), quantity, error)
    else if (dot > 1) then
      call find_force(frame, name(:dot - 1), name(dot + 1:), quantity)
    end if
    quantity%name = name
    quantity%dofs = frame%dofs()
    if (.not. (allocated(quantity%weights) .or. allocated(error))) call explain(frame, probes, name, error)
  end subroutine look_up_quantity

  pure subroutine explain(frame, probes, name, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: words
    integer :: in_space

    in_space = frame%dofs() / 6
    words = "unknown quantity '" // name // "': use xi, eta, psi" // of_space(", zeta, rot_xi, rot_eta") &
      & // " (also with _dot, _ddot), fx, fy" // of_space(", fz, mx, my") // ", m, f"
    if (size(frame%supports) > 0) words = words // ", support(1).fx (.fy, " // of_space(".fz, ") // ".f; up to " &
      & // text(size(frame%supports)) // ")"
    words = words // ", foundation.fx, guide.fx, total.fx (.fy, " // of_space(".fz, ") // ".f, " // of_space(".mx, .my, ") // ".m)"
    words = words // ", joint(NAME).f (.fx, .fy, .m)"
    if (size(probes) > 0) words = words // ", probe(" // trim(probes(1)%name) // ").x (.y, " // of_space(".z, ") &
      & // ".d, .vx, .vy, " // of_space(".vz, ") // ".v, .ax, .ay, " // of_space(".az, ") // ".a)"
    call fatal_error(error, words, invalid_input)

  contains

    !> Returns `names` if the frame moves in space, and an empty text if it moves in the plane.
    pure function of_space(names)
      character(len=*), intent(in) :: names
      character(len=in_space * len(names)) :: of_space

      of_space = names
    end function of_space

  end subroutine explain

  !> Finds a degree of freedom, its rate of change or its acceleration by `name`. If `name` denotes none of the three,
  !> `quantity%weights` is not allocated.
  pure subroutine find_coordinate(frame, name, quantity)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: name
    type(quantity_type), intent(inout) :: quantity
    integer :: dof, level

    do level = 0, 2
      do dof = 1, frame%dofs()
        if (name /= trim(dof_names(dof)) // trim(rates(level))) cycle
        allocate(quantity%weights(exact_rows(frame), 1), source=0.0_dp)
        quantity%weights(level * frame%dofs() + dof, 1) = 1
        quantity%unit = merge(turn_units(level), point_units(level) // "  ", is_rotation(dof))
      end do
    end do
  end subroutine find_coordinate

  !> Finds the force or moment `name` that `part` exerts on the ground. `part`: foundation, guide, total, a support such as
  !> support(2), or "" for supports and foundation together. If there is no such force, `quantity%weights` is not allocated.
  pure subroutine find_force(frame, part, name, quantity)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: part, name
    type(quantity_type), intent(inout) :: quantity
    type(ground_forces_type) :: forces
    integer, allocatable :: columns(:)
    integer :: number, k

    if (name == "f") then
      columns = shifts_of(frame)
    else
      columns = pack([(k, k = 1, frame%dofs())], force_names(:frame%dofs()) == name)
    end if
    if (size(columns) == 0) return
    forces = new_ground_forces(frame)
    select case (part)
    case ("", "total")
      call add_mounting(frame, forces)
      if (part == "total") call add_guides(frame, forces)
    case ("guide")
      call add_guides(frame, forces)
    case ("foundation")
      call add_matrices(frame%foundation_stiffness, frame%foundation_damping, forces)
    case default
      if (index(part, "support(") /= 1 .or. is_rotation(columns(1))) return
      number = whole_number(part(9:len(part) - 1))
      if (number < 1 .or. number > size(frame%supports) .or. part /= "support(" // text(number) // ")") return
      call add_matrices(stiffness_matrix(frame%supports(number:number), frame%dofs()), &
        & damping_matrix(frame%supports(number:number), frame%dofs()), forces)
      call add_turned(frame, number, forces)
    end select
    quantity%unit = merge("Nm", "N ", is_rotation(columns(1)))
    quantity%weights = forces%weights(:, columns)
    quantity%rounding = forces%rounding(:, columns)
  end subroutine find_force

  !> Adds the forces of the guides on the ground, along the locked degrees of freedom, and their moments about the rest position
  !> of the frame's centre of mass. Guides can also exert moments about axes about which the frame is free to rotate.
  pure subroutine add_guides(frame, forces)
    class(frame_type), intent(in) :: frame
    type(ground_forces_type), intent(inout) :: forces
    integer :: i, row

    if (size(frame%free) == frame%dofs()) return
    do i = 1, frame%dofs()
      if (any(frame%free == i) .and. .not. is_rotation(i)) cycle
      row = rows_of(frame%dofs(), accelerations) + i
      forces%weights(row, i) = forces%weights(row, i) + 1
    end do
  end subroutine add_guides

  !> Adds the forces and moments of supports and foundation on the ground.
  pure subroutine add_mounting(frame, forces)
    class(frame_type), intent(in) :: frame
    type(ground_forces_type), intent(inout) :: forces
    integer, allocatable :: rows(:), turns(:)
    integer :: k

    call add_matrices(frame%stiffness, frame%damping, forces)
    do k = 1, size(frame%supports)
      call add_turned(frame, k, forces)
    end do
    rows = moment_rows(frame)
    turns = rotations_of(frame)
    do k = 1, size(rows)
      forces%weights(rows(k), turns(k)) = 1
    end do
  end subroutine add_mounting

  !> Adds the forces of a mounting with stiffness `c` and damping `b` on the ground, and their moments about the rest position of
  !> the frame's centre of mass. Adds bounds on their rounding errors.
  pure subroutine add_matrices(c, b, forces)
    real(dp), intent(in) :: c(:, :), b(:, :)
    type(ground_forces_type), intent(inout) :: forces

    associate (n => size(c, 1))
      forces%weights(:n, :) = forces%weights(:n, :) + transpose(c)
      forces%weights(n + 1:2 * n, :) = forces%weights(n + 1:2 * n, :) + transpose(b)
      forces%rounding(:n, :) = forces%rounding(:n, :) + transpose(matrix_rounding(c))
      forces%rounding(n + 1:2 * n, :) = forces%rounding(n + 1:2 * n, :) + transpose(matrix_rounding(b))
    end associate
  end subroutine add_matrices

  !> Adds the part of a support's force that is due to the frame's rotation, and bounds on its rounding errors. If the axes have
  !> fixed directions, this is the force of the nonlinear part of the upper end's displacement. If the axes turn with the frame, it
  !> is the change of the static force by rotation, plus the nonlinear part of the support's force.
  pure subroutine add_turned(frame, number, forces)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    type(ground_forces_type), intent(inout) :: forces
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    real(dp), allocatable :: load(:, :), moved(:, :), c(:, :), b(:, :)
    integer, allocatable :: along(:), rows(:), turns(:)
    integer :: k, n

    n = frame%dofs()
    along = shifts_of(frame)
    associate (support => frame%supports(number:number))
      if (support(1)%turning) then
        turns = rotations_of(frame)
        rows = support_rows(frame, number)
        load = load_rounding(support, n)
        forces%weights(:n, :) = forces%weights(:n, :) + transpose(turned_loads(support, n))
        forces%rounding(turns, :) = forces%rounding(turns, :) + transpose(load(:, turns))
        do k = 1, size(rows)
          forces%weights(rows(k), along(k)) = 1
        end do
        return
      end if
      moved = excess_of_point(frame, support(1)%position)
      c = stiffness_matrix(support, n)
      b = damping_matrix(support, n)
    end associate
    do k = 0, 1
      associate (first => excess_row(frame, k) + 1, last => excess_row(frame, k + 1), &
        & turned => matmul(moved, merge(c(along, along), b(along, along), k == 0)))
        forces%weights(first:last, along) = forces%weights(first:last, along) + turned
        forces%rounding(first:last, along) = forces%rounding(first:last, along) + unit * abs(turned)
      end associate
    end do
  end subroutine add_turned

  !> The components of `point_parts` that a frame has: those along z only in space.
  pure function parts_of_point(frame) result(parts)
    class(frame_type), intent(in) :: frame
    character(len=2), allocatable :: parts(:)
    integer :: k

    parts = pack(point_parts, [(modulo(k, whole) /= z .or. size(shifts_of(frame)) == z, k = 1, size(point_parts))])
  end function parts_of_point

  !> Finds the displacement, velocity or acceleration of a probe along x, y or, for a frame in space, z; or the magnitude of the
  !> vector. `part`: name of this component. If there is no such component, `quantity%weights` is not allocated.
  pure subroutine point_quantity(frame, probe, part, quantity)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    !> One of `point_parts`
    character(len=*), intent(in) :: part
    type(quantity_type), intent(out) :: quantity
    real(dp), allocatable :: along(:, :)
    integer :: axis, level

    if (all(parts_of_point(frame) /= part)) return
    axis = findloc(point_parts, part, dim=1)
    level = (axis - 1) / whole
    axis = axis - whole * level
    along = point_rows(frame, probe, level)
    if (axis == whole) then
      quantity%weights = along
    else
      quantity%weights = along(:, axis:axis)
    end if
    quantity%name = "probe(" // trim(probe%name) // ")." // part
    quantity%unit = point_units(level)
    quantity%dofs = frame%dofs()
  end subroutine point_quantity

  !> Weights of the rows of the motion in a probe's displacement (`level` 0), velocity (1) or acceleration (2) along x, y and z,
  !> shape (rows, axes). The displacement of the probe at p is u + theta x p plus the nonlinear part of the rotation.
  pure function point_rows(frame, probe, level) result(along)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    integer, intent(in) :: level
    real(dp), allocatable :: along(:, :)
    integer, allocatable :: shifts(:), turns(:)
    real(dp) :: unit(3), arm(3), p(3)
    integer :: i, first

    p = [probe%position, probe%z]
    shifts = shifts_of(frame)
    turns = rotations_of(frame)
    first = level * frame%dofs()
    allocate(along(exact_rows(frame), size(shifts)), source=0.0_dp)
    do i = 1, size(shifts)
      unit = 0
      unit(i) = 1
      ! e . (theta x p) = theta . (p x e)
      arm = cross(p, unit)
      along(first + shifts(i), i) = 1
      along(first + turns, i) = arm(4 - size(turns):)
    end do
    along(excess_row(frame, level) + 1:excess_row(frame, level + 1), :) = excess_of_point(frame, p)
  end function point_rows

end module gestell_model_quantity
