!> The motion of a frame as rows of numbers, and quantities as weights of these.
!>
!> The motion of the frame is one column of 12 numbers, for (xi, eta, psi) each: q, q', q'', and the forces of the guides on
!> the ground, which hold the degrees of freedom that are not free. Of the exact frame 7 more follow: s = sin psi - psi and
!> c = cos psi - 1, their first and second derivatives, in which the motion of all points is linear again,
!>
!>     x = xi - Y (psi + s) + X c,   y = eta + X (psi + s) + Y c,
!>
!> and what the moment of the supports on the ground has beyond its linear terms; then, along x and y, what the force of each
!> support has whose axes turn with the frame, in their order.
!>
!> In space these are four times six numbers, in the order of the frame's degrees of freedom. Of the exact frame follow the nine
!> numbers of R - 1 - [theta], column by column, with which the displacements of all points are u + theta x p + (R - 1 - [theta]) p,
!> their first and second derivatives, and what the three moments on the ground have beyond their linear terms; then what
!> the three forces of each support have whose axes turn.
module gestell_model_quantity_rows
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  implicit none (type, external)
  private

  public :: exact_rows, is_of_probe, new_ground_forces, rows_of

  !> Names of the forces on the ground along the degrees of freedom of the frame, in their order: in the plane the first three.
  character(len=2), parameter, public :: force_names(6) = [character(len=2) :: "fx", "fy", "m", "fz", "mx", "my"]

  !> Rows of the motion in the plane: the last of q, q', q'' and the guides' forces.
  integer, parameter, public :: displacements = 3, velocities = 6, accelerations = 9, guide_forces = 12, &
    & sine = 13, cosine = 14, moment_excess = 19

  !> In space: where the 9 excesses of R and of their derivatives begin, those of the moments, and those of supports.
  integer, parameter, public :: turn_excess = 24, moments_excess = 51, supports_excess = 54

  !> A measuring point on the frame, in its system (m); the greatest vibration velocity (m/s, rms in the band of frequencies, Hz,
  !> in any direction) that is allowed, 0: no limit.
  type, public :: probe_type
    character(len=word_length) :: name = ""
    real(dp) :: position(2) = 0, z = 0, limit = 0, band(2) = [10.0_dp, 1000.0_dp]
  end type probe_type

  type, public :: quantity_type
    !> Of the frame whose motion it is of.
    integer :: dofs = 3
    !> As the user names it, and its unit.
    character(len=word_length) :: name = ""
    character(len=8) :: unit = ""
    !> Shape (rows, 1), or (rows, 2) of a magnitude, in space (rows, 3), whose components along x, y and z the columns give; rows:
    !> those of the exact frame's motion.
    real(dp), allocatable :: weights(:, :)
    !> Bounds on the weights' roundings, shape as theirs: forces that cancel in the weights do not in these.
    real(dp), allocatable :: rounding(:, :)
  contains
    procedure :: rows
  end type quantity_type

  !> Forces on the ground and their moments about F at rest, in the frame's order of degrees of freedom: weights of the motion's
  !> rows, and bounds on the weights' roundings; shapes (rows, dofs).
  type, public :: ground_forces_type
    real(dp), allocatable :: weights(:, :), rounding(:, :)
  end type ground_forces_type

contains

  !> Whether a part of the machine, as the user names it, is this probe: probe(NAME).
  pure logical function is_of_probe(part, probe)
    character(len=*), intent(in) :: part
    type(probe_type), intent(in) :: probe
    integer :: n

    n = len(part)
    is_of_probe = n > len("probe()")
    if (is_of_probe) is_of_probe = part(:6) == "probe(" .and. part(n:n) == ")" .and. part(7:n - 1) == probe%name
  end function is_of_probe

  !> No forces on the ground yet.
  pure type(ground_forces_type) function new_ground_forces(frame) result(forces)
    class(frame_type), intent(in) :: frame

    allocate(forces%weights(exact_rows(frame), frame%dofs()), forces%rounding(exact_rows(frame), frame%dofs()), source=0.0_dp)
  end function new_ground_forces

  !> How many rows the exact frame's motion has.
  pure integer function exact_rows(frame)
    class(frame_type), intent(in) :: frame
    integer :: k

    if (allocated(frame%space)) then
      exact_rows = supports_excess + 3 * count(frame%space%supports%turning)
      return
    end if
    exact_rows = moment_excess + 2 * count([(frame%supports(k)%turning, k = 1, size(frame%supports))])
  end function exact_rows

  !> Rows of the motion of a frame that has so many degrees of freedom, down to one of those above.
  pure integer function rows_of(dofs, last)
    integer, intent(in) :: dofs, last

    rows_of = last / 3 * dofs
  end function rows_of

  !> Down to which rows of the motion, of those above, the quantity needs it; the exact frame has all.
  pure integer function rows(self)
    class(quantity_type), intent(in) :: self
    integer :: k

    rows = velocities
    do k = rows_of(self%dofs, velocities) + 1, rows_of(self%dofs, guide_forces)
      if (any(abs(self%weights(k, :)) > 0)) rows = merge(accelerations, guide_forces, k <= rows_of(self%dofs, accelerations))
    end do
  end function rows

end module gestell_model_quantity_rows
