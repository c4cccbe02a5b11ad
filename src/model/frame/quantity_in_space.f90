!> Quantities of the vibration of a frame in space, as rows of weights (gestell_model_frame_rows).
module gestell_model_frame_quantity_in_space
  use gestell_base_error, only: error_type, fatal_error, invalid_input
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: text
  use gestell_model_frame, only: dof_names, frame_type
  use gestell_model_frame_mounting, only: matrix_rounding
  use gestell_model_frame_rows, only: accelerations, exact_rows, is_of_probe, moments_excess, probe_type, quantity_type, rows_of, &
    & supports_excess, turn_excess
  use gestell_model_space, only: in_frame, is_rotation
  use gestell_model_space_mounting, only: space_support_type, support_matrix, turned_loads
  use gestell_model_space_rotation, only: cross
  implicit none (type, external)
  private

  public :: look_up_in_space, point_in_space

  character(len=2), parameter, public :: point_parts(12) = [character(len=2) :: "x", "y", "z", "d", "vx", "vy", "vz", "v", &
    & "ax", "ay", "az", "a"]
  character(len=*), parameter :: point_units(3) = [character(len=5) :: "m", "m/s", "m/s^2"]
  character(len=*), parameter :: force_parts(7) = [character(len=2) :: "fx", "fy", "fz", "mx", "my", "m", "f"]
  character(len=*), parameter :: words = "xi, eta, zeta, rot_xi, rot_eta, psi (also with _dot), fx, fy, fz, f, mx, my, m"

  !> Forces and moments about F at rest, of (u, theta): weights of the motion's rows and bounds on their roundings, shape
  !> (rows, 6).
  type :: forces_type
    real(dp), allocatable :: weights(:, :), rounding(:, :)
  contains
    procedure :: add
  end type forces_type

contains

  !> As `look_up_quantity` of the plane, with zeta, rot_xi, rot_eta, and .z, .vz, .az, .fz, .mx, .my; m is the moment about zeta.
  !> Error: there is no such quantity.
  pure subroutine look_up_in_space(frame, probes, name, quantity, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(quantity_type), intent(out) :: quantity
    type(error_type), allocatable, intent(out) :: error
    type(forces_type) :: forces
    integer :: dot, dof, k, number

    allocate(forces%weights(exact_rows(frame), 6), forces%rounding(exact_rows(frame), 6), source=0.0_dp)
    do dof = 1, 6
      if (name /= trim(dof_names(dof)) .and. name /= trim(dof_names(dof)) // "_dot") cycle
      allocate(quantity%weights(exact_rows(frame), 1), source=0.0_dp)
      k = merge(0, 6, name == dof_names(dof))
      quantity%weights(k + dof, 1) = 1
      quantity%unit = merge("rad", "m  ", is_rotation(dof))
      if (k > 0) quantity%unit = trim(quantity%unit) // "/s"
    end do
    dot = index(name, ".", back=.true.)
    if (index(name, ")", back=.true.) > dot) dot = 0
    number = -1
    if (any(name == force_parts)) then
      number = 0
      call add_mounting(frame, 0, forces)
      if (name == "f") call add_guides(frame, forces)
    else if (dot > 1) then
      do k = 1, size(probes)
        if (.not. is_of_probe(name(:dot - 1), probes(k))) cycle
        if (any(point_parts == name(dot + 1:))) call point_in_space(frame, probes(k), name(dot + 1:), quantity)
      end do
      call take_part(frame, name(:dot - 1), number, forces)
      if (number > 0 .and. index(name(dot + 1:), "m") == 1) number = -1
    end if
    if (number >= 0) call take_forces(forces, name(dot + 1:), quantity)
    quantity%name = name
    quantity%dofs = 6
    if (.not. allocated(quantity%weights)) call explain(frame, probes, name, error)
  end subroutine look_up_in_space

  pure subroutine explain(frame, probes, name, error)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probes(:)
    character(len=*), intent(in) :: name
    type(error_type), allocatable, intent(out) :: error
    character(len=:), allocatable :: message

    message = "'" // name // "' is no quantity: there are " // words
    if (size(frame%space%supports) > 0) message = message // ", support(1).fx (.fy, .fz, .f; to " &
      & // text(size(frame%space%supports)) // ")"
    message = message // ", foundation.fx, guide.fx (.fy, .fz, .f, .mx, .my, .m)"
    if (size(probes) > 0) message = message // ", probe(" // trim(probes(1)%name) // ").x (.y, .z, .d, .vx, .vy, .vz, .v, .ax, " &
      & // ".ay, .az, .a)"
    call fatal_error(error, message, invalid_input)
  end subroutine explain

  !> The forces of `part`: support(2), foundation, guide; `number`: of the support, 0 of the others, -1: there is no such part.
  pure subroutine take_part(frame, part, number, forces)
    class(frame_type), intent(in) :: frame
    character(len=*), intent(in) :: part
    integer, intent(out) :: number
    type(forces_type), intent(inout) :: forces

    number = 0
    if (part == "foundation") then
      call forces%add(frame%space%foundation_stiffness, frame%space%foundation_damping)
    else if (part == "guide") then
      call add_guides(frame, forces)
    else
      do number = 1, size(frame%space%supports)
        if (part == "support(" // text(number) // ")") exit
      end do
      if (number > size(frame%space%supports)) then
        number = -1
      else
        call add_mounting(frame, number, forces)
      end if
    end if
  end subroutine take_part

  !> Adds a support, or, with number 0, all that holds the frame.
  pure subroutine add_mounting(frame, number, forces)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    type(forces_type), intent(inout) :: forces
    integer :: i

    associate (space => frame%space)
      if (number == 0) then
        call forces%add(space%stiffness, space%damping)
        do i = 4, 6
          forces%weights(moments_excess + i - 3, i) = 1
        end do
      else
        call forces%add(support_matrix(space%supports(number), space%supports(number)%stiffness), &
          & support_matrix(space%supports(number), space%supports(number)%damping))
      end if
      do i = max(1, number), merge(size(space%supports), number, number == 0)
        call add_turned(space%supports, i, forces)
      end do
    end associate
  end subroutine add_mounting

  !> Adds what the force of a support has by the frame's turn: where its axes stay in space, rows of R - 1 - [theta], which moves
  !> its head too; else its static force turned, and its own rows of the exact frame.
  pure subroutine add_turned(supports, number, forces)
    type(space_support_type), intent(in) :: supports(:)
    integer, intent(in) :: number
    type(forces_type), intent(inout) :: forces
    real(dp), parameter :: unit = 16 * epsilon(1.0_dp)
    real(dp) :: c(6, 6), k(3, 3), d(3, 3)
    integer :: i, row

    associate (support => supports(number), p => supports(number)%position)
      if (support%turning) then
        c = turned_loads([support])
        forces%weights(in_frame, :) = forces%weights(in_frame, :) + transpose(c)
        forces%rounding(in_frame(4:), :3) = forces%rounding(in_frame(4:), :3) + unit * norm2(support%static)
        forces%rounding(in_frame(4:), 4:) = forces%rounding(in_frame(4:), 4:) + unit * norm2(support%static) * norm2(p)
        row = supports_excess + 3 * count(supports(:number - 1)%turning)
        do i = 1, 3
          forces%weights(row + i, i) = 1
        end do
        return
      end if
      c = support_matrix(support, support%stiffness)
      k = c(:3, :3)
      c = support_matrix(support, support%damping)
      d = c(:3, :3)
      do i = 1, 3
        row = turn_excess + 3 * (i - 1)
        forces%weights(row + 1:row + 3, :3) = forces%weights(row + 1:row + 3, :3) + p(i) * k
        forces%weights(row + 10:row + 12, :3) = forces%weights(row + 10:row + 12, :3) + p(i) * d
      end do
    end associate
  end subroutine add_turned

  !> Adds a mounting's matrices of (u, theta).
  pure subroutine add(self, c, b)
    class(forces_type), intent(inout) :: self
    real(dp), intent(in) :: c(6, 6), b(6, 6)

    self%weights(in_frame, :) = self%weights(in_frame, :) + transpose(c)
    self%weights(6 + in_frame, :) = self%weights(6 + in_frame, :) + transpose(b)
    self%rounding(in_frame, :) = self%rounding(in_frame, :) + matrix_rounding(c)
    self%rounding(6 + in_frame, :) = self%rounding(6 + in_frame, :) + matrix_rounding(b)
  end subroutine add

  pure subroutine add_guides(frame, forces)
    class(frame_type), intent(in) :: frame
    type(forces_type), intent(inout) :: forces
    integer :: i

    do i = 1, 6
      if (all(frame%free /= in_frame(i))) forces%weights(rows_of(6, accelerations) + in_frame(i), i) = 1
    end do
  end subroutine add_guides

  pure subroutine take_forces(forces, part, quantity)
    type(forces_type), intent(in) :: forces
    character(len=*), intent(in) :: part
    type(quantity_type), intent(inout) :: quantity
    integer, allocatable :: columns(:)
    integer :: number

    number = findloc(force_parts, part, dim=1)
    if (number == 0) return
    columns = [number]
    if (part == "f") columns = [1, 2, 3]
    quantity%unit = merge("Nm", "N ", part(1:1) == "m")
    quantity%weights = forces%weights(:, columns)
    quantity%rounding = forces%rounding(:, columns)
  end subroutine take_forces

  !> Displacement (x, y, z, d), velocity (vx, ...) or acceleration (ax, ...) of a point of the frame: u + theta x p + (R - 1 -
  !> [theta]) p and its derivatives.
  pure subroutine point_in_space(frame, probe, part, quantity)
    class(frame_type), intent(in) :: frame
    type(probe_type), intent(in) :: probe
    character(len=*), intent(in) :: part
    type(quantity_type), intent(out) :: quantity
    real(dp) :: along(exact_rows(frame), 3), unit(3), p(3)
    integer :: number, level, i, row

    p = [probe%position, probe%z]
    number = findloc(point_parts, part, dim=1)
    level = (number - 1) / 4
    along = 0
    do i = 1, 3
      unit = 0
      unit(i) = 1
      row = 6 * level
      along(row + in_frame(i), i) = 1
      ! e . (theta x p) = theta . (p x e)
      along(row + in_frame(4:), i) = cross(p, unit)
      row = turn_excess + 9 * level
      along([row + i, row + 3 + i, row + 6 + i], i) = p
    end do
    number = number - 4 * level
    quantity%name = "probe(" // trim(probe%name) // ")." // part
    quantity%unit = point_units(1 + level)
    quantity%dofs = 6
    if (number == 4) then
      quantity%weights = along
    else
      quantity%weights = along(:, number:number)
    end if
  end subroutine point_in_space

end module gestell_model_frame_quantity_in_space
