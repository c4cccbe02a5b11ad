!> Quantities of the vibration that are linear in the motion, as rows of weights: displacements, velocities and
!> accelerations of points of the frame, forces of single supports and in total.
module gestell_model_frame_quantity
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_model_frame, only: frame_type
  use gestell_model_frame_mounting, only: damping_matrix, load_rounding, matrix_rounding, stiffness_matrix, support_type, &
    & turned_loads
  use gestell_model_frame_quantity_in_space, only: look_up_in_space, point_in_space
  use gestell_model_frame_rows, only: accelerations, cosine, exact_rows, is_of_probe, moment_excess, probe_type, quantity_type, sine
  implicit none (type, external)
  private

  public :: find_quantity, look_up_quantity, point_quantity

  character(len=*), parameter :: coordinates(6) = [character(len=7) :: "xi", "eta", "psi", "xi_dot", "eta_dot", "psi_dot"]
  character(len=*), parameter :: coordinate_units(6) = [character(len=5) :: "m", "m", "rad", "m/s", "m/s", "rad/s"]
  character(len=*), parameter :: point_parts(9) = [character(len=2) :: "x", "y", "d", "vx", "vy", "v", "ax", "ay", "a"]
  character(len=*), parameter :: point_units(3) = [character(len=5) :: "m", "m/s", "m/s^2"]
  character(len=*), parameter :: force_parts(3) = [character(len=2) :: "fx", "fy", "f"]

contains

  !> The quantity of that name: xi, eta, psi and with _dot; fx, fy, m, f (forces and moment on the ground as in the
  !> response, the magnitude of the whole force, that of guides with it); support(2).fx, .fy, .f; foundation.fx, .fy, .f, .m;
  !> guide.fx, .fy, .f, .m; probe(name).x, .y, .d, .vx, .vy, .v, .ax, .ay, .a.
  !> Errors: there is none; as of the frame's `check`.
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
    real(dp), allocatable, dimension(:, :) :: forces, rounding
    integer :: dot, part, number, k

    if (allocated(frame%space)) then
      call look_up_in_space(frame, probes, name, quantity, error)
      return
    end if
    allocate(forces(exact_rows(frame), 3), rounding(exact_rows(frame), 3))
    dot = index(name, ".", back=.true.)
    if (index(name, ")", back=.true.) > dot) dot = 0
    part = findloc(coordinates, name, dim=1)
    if (part > 0) then
      allocate(quantity%weights(exact_rows(frame), 1), source=0.0_dp)
      quantity%weights(part, 1) = 1
      quantity%unit = coordinate_units(part)
    else if (any(name == [character(len=2) :: force_parts, "m"])) then
      forces = mounting_forces(frame, frame%stiffness, frame%damping)
      if (name == "f") call add_guides(frame, forces)
      rounding = mounting_forces(frame, matrix_rounding(frame%stiffness), matrix_rounding(frame%damping))
      do k = 1, size(frame%supports)
        call add_turned(frame, k, forces, rounding)
      end do
      forces(moment_excess, 3) = 1
      call take_forces(forces, rounding, name, quantity)
    else if (dot > 1 .and. index(name, "probe(") == 1) then
      do k = 1, size(probes)
        if (.not. is_of_probe(name(:dot - 1), probes(k))) cycle
        if (any(point_parts == name(dot + 1:))) call point_quantity(frame, probes(k), name(dot + 1:), quantity)
      end do
    else if (dot > 1) then
      call part_forces(frame, name(:dot - 1), number, forces, rounding)
      if (number >= 0 .and. (number == 0 .or. name(dot + 1:) /= "m")) then
        call take_forces(forces, rounding, name(dot + 1:), quantity)
      end if
    end if
    quantity%name = name
    if (allocated(quantity%weights)) return
    call explain(frame, probes, name, error)
  end subroutine look_up_quantity

  pure subroutine explain(frame, probes, name, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: words

    words = "'" // name // "' is no quantity: there are xi, eta, psi, xi_dot, eta_dot, psi_dot, fx, fy, m, f"
    if (size(frame%supports) > 0) words = words // ", support(1).fx (.fy, .f; to " // text(size(frame%supports)) // ")"
    words = words // ", foundation.fx, guide.fx (.fy, .f, .m)"
    if (size(probes) > 0) words = words // ", probe(" // trim(probes(1)%name) // ").x (.y, .d, .vx, .vy, .v, .ax, .ay, .a)"
    call fatal_error(error, words, invalid_input)
  end subroutine explain

  !> The forces that `part` (support(2), foundation, guide) exerts on the ground and bounds on their roundings; `number`: of the
  !> support, 0 for the others, -1: there is no such part.
  pure subroutine part_forces(frame, part, number, forces, rounding)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: part
    integer, intent(out) :: number
    real(dp), dimension(:, :), intent(out) :: forces, rounding

    forces = 0
    rounding = 0
    number = 0
    if (part == "foundation") then
      call foundation_forces(frame, forces)
      rounding = mounting_forces(frame, matrix_rounding(frame%stiffness), matrix_rounding(frame%damping))
    else if (part == "guide") then
      call add_guides(frame, forces)
    else
      do number = 1, size(frame%supports)
        if (part == "support(" // text(number) // ")") exit
      end do
      if (number > size(frame%supports)) then
        number = -1
      else
        associate (c => stiffness_matrix([frame%supports(number)]), b => damping_matrix([frame%supports(number)]))
          forces = mounting_forces(frame, c, b)
          rounding = mounting_forces(frame, matrix_rounding(c), matrix_rounding(b))
        end associate
        call add_turned(frame, number, forces, rounding)
      end if
    end if
  end subroutine part_forces

  !> The forces (fx, fy, moment about F at rest) on the ground of a mounting with stiffness c and damping b, shape (3, 3).
  pure function mounting_forces(frame, c, b) result(forces)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: c(3, 3), b(3, 3)
    real(dp) :: forces(exact_rows(frame), 3)

    forces = 0
    forces(:3, :) = transpose(c)
    forces(4:6, :) = transpose(b)
  end function mounting_forces

  !> Adds what the force of a support has by the frame's turn and bounds on its roundings: where its axes stay in space, rows of s
  !> and c, for its head is moved by s k x p + c p too; else its static load turned, and its own rows of the exact frame.
  pure subroutine add_turned(frame, number, forces, rounding)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    real(dp), intent(inout) :: forces(:, :), rounding(:, :)
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    real(dp) :: turned(4, 2)
    type(support_type) :: support
    integer :: own, k

    support = frame%supports(number)
    if (support%turning) then
      forces(:3, :) = forces(:3, :) + transpose(turned_loads([support]))
      associate (load => load_rounding([support]))
        rounding(3, :) = rounding(3, :) + load(:, 3)
      end associate
      own = moment_excess + 2 * count([(frame%supports(k)%turning, k = 1, number - 1)])
      forces(own + 1, 1) = 1
      forces(own + 2, 2) = 1
      return
    end if
    associate (c => stiffness_matrix([support]), b => damping_matrix([support]), p => support%position)
      turned(1, :) = matmul(c(:2, :2), [-p(2), p(1)])
      turned(2, :) = matmul(c(:2, :2), p)
      turned(3, :) = matmul(b(:2, :2), [-p(2), p(1)])
      turned(4, :) = matmul(b(:2, :2), p)
    end associate
    forces(sine:sine + 3, :2) = forces(sine:sine + 3, :2) + turned
    rounding(sine:sine + 3, :2) = rounding(sine:sine + 3, :2) + unit * abs(turned)
  end subroutine add_turned

  !> What is left of the mounting without its supports; differences that are rounding are zero.
  pure subroutine foundation_forces(frame, forces)
    class(frame_type), intent(in) :: frame
    real(dp), intent(out) :: forces(:, :)

    forces = 0
    associate (c => frame%stiffness - stiffness_matrix(frame%supports), b => frame%damping - damping_matrix(frame%supports))
      forces = mounting_forces(frame, merge(c, 0.0_dp, abs(c) > matrix_rounding(frame%stiffness)), &
        & merge(b, 0.0_dp, abs(b) > matrix_rounding(frame%damping)))
    end associate
  end subroutine foundation_forces

  !> Adds the guides' forces: those along degrees of freedom that are not free.
  pure subroutine add_guides(frame, forces)
    class(frame_type), intent(in) :: frame
    real(dp), intent(inout) :: forces(:, :)
    integer :: i

    do i = 1, 3
      if (any(frame%free == i)) cycle
      forces(accelerations + i, i) = forces(accelerations + i, i) + 1
    end do
  end subroutine add_guides

  pure subroutine take_forces(forces, rounding, part, quantity)
    real(dp), dimension(:, :), intent(in) :: forces, rounding
    character(len=*), intent(in) :: part
    type(quantity_type), intent(inout) :: quantity

    integer, allocatable :: columns(:)

    select case (part)
    case ("fx")
      columns = [1]
    case ("fy")
      columns = [2]
    case ("f")
      columns = [1, 2]
    case ("m")
      columns = [3]
    case default
      return
    end select
    quantity%unit = merge("Nm", "N ", part == "m")
    quantity%weights = forces(:, columns)
    quantity%rounding = rounding(:, columns)
  end subroutine take_forces

  !> The displacement (part x, y, d for the magnitude), velocity (vx, vy, v) or acceleration (ax, ay, a) of a point of the
  !> `frame` at (X, Y): (xi - Y psi, eta + X psi) and its derivatives.
  pure subroutine point_quantity(frame, probe, part, quantity)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    character(len=*), intent(in) :: part
    type(quantity_type), intent(out) :: quantity
    real(dp) :: along(exact_rows(frame), 2)
    integer :: number, first

    if (allocated(frame%space)) then
      call point_in_space(frame, probe, part, quantity)
      return
    end if
    number = findloc(point_parts, part, dim=1)
    first = 3 * ((number - 1) / 3)
    along = 0
    along(first + 1, 1) = 1
    along(first + 3, 1) = -probe%position(2)
    along(first + 2, 2) = 1
    along(first + 3, 2) = probe%position(1)
    associate (s => sine + 2 * first / 3, c => cosine + 2 * first / 3)
      along(s, :) = [-probe%position(2), probe%position(1)]
      along(c, :) = probe%position
    end associate
    number = number - first
    quantity%name = "probe(" // trim(probe%name) // ")." // part
    quantity%unit = point_units(1 + first / 3)
    if (number == 3) then
      quantity%weights = along
    else
      quantity%weights = along(:, number:number)
    end if
  end subroutine point_quantity

end module gestell_model_frame_quantity
