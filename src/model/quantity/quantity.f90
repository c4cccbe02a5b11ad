!> Quantities of the vibration that are linear in the motion, as rows of weights: displacements, velocities and
!> accelerations of the frame and of its points, forces of single supports and in total. The names are those of the plane and of
!> space; what a mounting in space exerts, and how its points move, stands in gestell_model_quantity_quantity_in_space.
module gestell_model_quantity
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text, whole_number
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_model_frame_mounting, only: damping_matrix, load_rounding, matrix_rounding, stiffness_matrix, support_type, &
    & turned_loads
  use gestell_model_quantity_quantity_in_space, only: add_foundation_in_space => add_foundation, &
    & add_mounting_in_space => add_mounting, add_support_in_space => add_support, point_rows_in_space => point_rows
  use gestell_model_quantity_rows, only: accelerations, cosine, exact_rows, force_names, ground_forces_type, is_of_probe, &
    & moment_excess, new_ground_forces, probe_type, quantity_type, rows_of, sine
  use gestell_model_space, only: is_rotation
  implicit none (type, external)
  private

  public :: find_quantity, look_up_quantity, point_quantity

  !> The parts of a probe's motion: along x, y, z, the size of the vector, of displacement, velocity and acceleration.
  character(len=2), parameter, public :: point_parts(12) = [character(len=2) :: "x", "y", "z", "d", "vx", "vy", "vz", "v", &
    & "ax", "ay", "az", "a"]
  character(len=*), parameter :: point_units(0:2) = [character(len=5) :: "m", "m/s", "m/s^2"]
  character(len=*), parameter :: turn_units(0:2) = [character(len=7) :: "rad", "rad/s", "rad/s^2"]
  character(len=*), parameter :: rates(0:2) = [character(len=5) :: "", "_dot", "_ddot"]

contains

  !> The quantity of that name:
  !>   xi, eta, psi, in space zeta, rot_xi, rot_eta too, also with _dot, _ddot;
  !>   forces on the ground .fx, .fy, .f and their moment .m, in space .fz, .mx, .my too, of support(2) (no moments), foundation,
  !>   guide, total; without a part's name those of supports and foundation together, except f, which is total.f;
  !>   probe(name).x, .y, .d, .vx, .vy, .v, .ax, .ay, .a, in space .z, .vz, .az too.
  !> Errors: there is no such quantity; as of the frame's `check`.
  subroutine find_quantity(frame, probes, name, quantity, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(quantity_type), intent(out) :: quantity
    type(error_type), allocatable, intent(out) :: error

    call frame%check(error)
    if (.not. allocated(error)) call look_up_quantity(frame, probes, name, quantity, error)
  end subroutine find_quantity

  !> The same of a frame whose mechanism need not turn: what the name means. Error: there is no such quantity.
  pure subroutine look_up_quantity(frame, probes, name, quantity, error)
    class(frame_type), intent(in) :: frame
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
    else if (dot > 1) then
      call find_force(frame, name(:dot - 1), name(dot + 1:), quantity)
    end if
    quantity%name = name
    quantity%dofs = frame%dofs()
    if (.not. allocated(quantity%weights)) call explain(frame, probes, name, error)
  end subroutine look_up_quantity

  pure subroutine explain(frame, probes, name, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: words
    integer :: supports, in_space

    in_space = merge(1, 0, allocated(frame%space))
    supports = size(frame%supports)
    if (allocated(frame%space)) supports = size(frame%space%supports)
    words = "'" // name // "' is no quantity: there are xi, eta, psi"
    if (allocated(frame%space)) words = words // ", zeta, rot_xi, rot_eta"
    words = words // " (also with _dot, _ddot), fx, fy"
    if (allocated(frame%space)) words = words // ", fz, mx, my"
    words = words // ", m, f"
    if (supports > 0) words = words // ", support(1).fx (.fy, " // of_space(".fz, ") // ".f; to " // text(supports) // ")"
    words = words // ", foundation.fx, guide.fx, total.fx (.fy, " // of_space(".fz, ") // ".f, " // of_space(".mx, .my, ") // ".m)"
    if (size(probes) > 0) words = words // ", probe(" // trim(probes(1)%name) // ").x (.y, " // of_space(".z, ") &
      & // ".d, .vx, .vy, " // of_space(".vz, ") // ".v, .ax, .ay, " // of_space(".az, ") // ".a)"
    call fatal_error(error, words, invalid_input)

  contains

    !> These names where the frame is in space, else nothing.
    pure function of_space(names)
      character(len=*), intent(in) :: names
      character(len=in_space * len(names)) :: of_space

      of_space = names
    end function of_space

  end subroutine explain

  !> A degree of freedom or its rate or acceleration; none: `quantity` gets no weights.
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

  !> The force or moment `name` on the ground of `part`: "" (supports and foundation), guide, total (both), foundation, support(2);
  !> none: `quantity` gets no weights.
  pure subroutine find_force(frame, part, name, quantity)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: part, name
    type(quantity_type), intent(inout) :: quantity
    type(ground_forces_type) :: forces
    integer, allocatable :: columns(:)
    integer :: number, k

    if (name == "f") then
      columns = pack([(k, k = 1, frame%dofs())], .not. is_rotation([(k, k = 1, frame%dofs())]))
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
      call add_foundation(frame, forces)
    case default
      number = support_number(frame, part)
      if (number == 0 .or. is_rotation(columns(1))) return
      call add_support(frame, number, forces)
    end select
    quantity%unit = merge("Nm", "N ", is_rotation(columns(1)))
    quantity%weights = forces%weights(:, columns)
    quantity%rounding = forces%rounding(:, columns)
  end subroutine find_force

  !> The number of the support that is called `part`; 0: there is none.
  pure integer function support_number(frame, part) result(number)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: part
    integer :: supports

    supports = size(frame%supports)
    if (allocated(frame%space)) supports = size(frame%space%supports)
    number = 0
    if (index(part, "support(") /= 1) return
    number = whole_number(part(9:len(part) - 1))
    if (number > supports .or. part /= "support(" // text(number) // ")") number = 0
  end function support_number

  !> Adds the guides: the forces along the degrees of freedom that are not free. Their rows of moments hold all of the guides'
  !> moments about F at rest, also where the frame may turn.
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

  !> Adds all that holds the frame but the guides.
  pure subroutine add_mounting(frame, forces)
    class(frame_type), intent(in) :: frame
    type(ground_forces_type), intent(inout) :: forces
    integer :: k

    if (allocated(frame%space)) then
      call add_mounting_in_space(frame, forces)
      return
    end if
    call add_matrices(forces, frame%stiffness, frame%damping, matrix_rounding(frame%stiffness), matrix_rounding(frame%damping))
    do k = 1, size(frame%supports)
      call add_turned(frame, k, forces)
    end do
    forces%weights(moment_excess, 3) = 1
  end subroutine add_mounting

  !> Adds the support of this number.
  pure subroutine add_support(frame, number, forces)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    type(ground_forces_type), intent(inout) :: forces

    if (allocated(frame%space)) then
      call add_support_in_space(frame, number, forces)
      return
    end if
    associate (c => stiffness_matrix([frame%supports(number)]), b => damping_matrix([frame%supports(number)]))
      call add_matrices(forces, c, b, matrix_rounding(c), matrix_rounding(b))
    end associate
    call add_turned(frame, number, forces)
  end subroutine add_support

  !> Adds what is left of the mounting without its supports; differences that are rounding are zero.
  pure subroutine add_foundation(frame, forces)
    class(frame_type), intent(in) :: frame
    type(ground_forces_type), intent(inout) :: forces

    if (allocated(frame%space)) then
      call add_foundation_in_space(frame, forces)
      return
    end if
    associate (c => frame%stiffness - stiffness_matrix(frame%supports), b => frame%damping - damping_matrix(frame%supports), &
      & c_rounding => matrix_rounding(frame%stiffness), b_rounding => matrix_rounding(frame%damping))
      call add_matrices(forces, merge(c, 0.0_dp, abs(c) > c_rounding), merge(b, 0.0_dp, abs(b) > b_rounding), c_rounding, &
        & b_rounding)
    end associate
  end subroutine add_foundation

  !> Adds the forces (fx, fy, moment about F at rest) on the ground of a mounting with stiffness c and damping b, shape (3, 3), and
  !> bounds on these.
  pure subroutine add_matrices(forces, c, b, c_rounding, b_rounding)
    type(ground_forces_type), intent(inout) :: forces
    real(dp), dimension(3, 3), intent(in) :: c, b, c_rounding, b_rounding

    forces%weights(:3, :) = forces%weights(:3, :) + transpose(c)
    forces%weights(4:6, :) = forces%weights(4:6, :) + transpose(b)
    forces%rounding(:3, :) = forces%rounding(:3, :) + transpose(c_rounding)
    forces%rounding(4:6, :) = forces%rounding(4:6, :) + transpose(b_rounding)
  end subroutine add_matrices

  !> Adds what the force of a support has by the frame's turn and bounds on its roundings: where its axes stay in space, rows of s
  !> and c, for its head is moved by s k x p + c p too; else its static load turned, and its own rows of the exact frame.
  pure subroutine add_turned(frame, number, forces)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    type(ground_forces_type), intent(inout) :: forces
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    real(dp) :: turned(4, 2)
    type(support_type) :: support
    integer :: own, k

    support = frame%supports(number)
    if (support%turning) then
      forces%weights(:3, :) = forces%weights(:3, :) + transpose(turned_loads([support]))
      associate (load => load_rounding([support]))
        forces%rounding(3, :) = forces%rounding(3, :) + load(:, 3)
      end associate
      own = moment_excess + 2 * count([(frame%supports(k)%turning, k = 1, number - 1)])
      forces%weights(own + 1, 1) = 1
      forces%weights(own + 2, 2) = 1
      return
    end if
    associate (c => stiffness_matrix([support]), b => damping_matrix([support]), p => support%position)
      turned(1, :) = matmul(c(:2, :2), [-p(2), p(1)])
      turned(2, :) = matmul(c(:2, :2), p)
      turned(3, :) = matmul(b(:2, :2), [-p(2), p(1)])
      turned(4, :) = matmul(b(:2, :2), p)
    end associate
    forces%weights(sine:sine + 3, :2) = forces%weights(sine:sine + 3, :2) + turned
    forces%rounding(sine:sine + 3, :2) = forces%rounding(sine:sine + 3, :2) + unit * abs(turned)
  end subroutine add_turned

  !> The displacement (part x, y, z, d for the magnitude), velocity (vx, ..., v) or acceleration (ax, ..., a) of a point of the
  !> `frame`; z in space only. There is no such part: `quantity` gets no weights.
  pure subroutine point_quantity(frame, probe, part, quantity)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    character(len=*), intent(in) :: part
    type(quantity_type), intent(out) :: quantity
    integer, parameter :: z = 3, whole = 4
    real(dp), allocatable :: along(:, :)
    integer :: axis, level

    axis = findloc(point_parts, part, dim=1)
    level = (axis - 1) / whole
    axis = axis - whole * level
    if (axis == 0 .or. axis == z .and. .not. allocated(frame%space)) return
    if (allocated(frame%space)) then
      along = point_rows_in_space(frame, probe, level)
    else
      along = point_rows(frame, probe, level)
    end if
    if (axis == whole) then
      quantity%weights = along
    else
      quantity%weights = along(:, axis:axis)
    end if
    quantity%name = "probe(" // trim(probe%name) // ")." // part
    quantity%unit = point_units(level)
    quantity%dofs = frame%dofs()
  end subroutine point_quantity

  !> How the place of a probe at (X, Y), level 0, its velocity, 1, or acceleration, 2, along x and y follows from the motion, shape
  !> (rows, 2): (xi - Y psi, eta + X psi) and its derivatives.
  pure function point_rows(frame, probe, level) result(along)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    integer, intent(in) :: level
    real(dp) :: along(exact_rows(frame), 2)

    along = 0
    associate (first => 3 * level, s => sine + 2 * level, c => cosine + 2 * level)
      along(first + 1, 1) = 1
      along(first + 3, 1) = -probe%position(2)
      along(first + 2, 2) = 1
      along(first + 3, 2) = probe%position(1)
      along(s, :) = [-probe%position(2), probe%position(1)]
      along(c, :) = probe%position
    end associate
  end function point_rows

end module gestell_model_quantity
