!> The motion of a frame as a table of numbers: each row is one quantity, each column one phase. Other quantities are weighted sums
!> of these rows.
!>
!> The first rows contain q, q', q'' of the n degrees of freedom. The next n rows contain the forces that the guides, which lock
!> degrees of freedom, exert on the ground. For the exact frame further rows contain the nonlinear parts of some functions of q.
!> Such a part is called the excess here: the function minus its linearisation about rest.
!>
!> - The excess of the rotation and its first and second derivatives. In the plane it is s = sin psi - psi and c = cos psi - 1; in
!>   space it is the nine elements of R - 1 - [theta], column by column. With these rows the motion of all points is linear: in the
!>   plane x = xi - Y (psi + s) + X c and y = eta + X (psi + s) + Y c, in space u + theta x p + (R - 1 - [theta]) p.
!>
!> - The excess of the supports' moments on the ground: one row in the plane, three in space.
!>
!> - The excess of the force of each support whose axes turn with the frame: two rows in the plane, three in space.
module gestell_model_quantity_rows
  use gestell_base_kinds, only: dp
  use gestell_base_words, only: word_length
  use gestell_model_frame, only: frame_type
  use gestell_model_mounting, only: in_frame, is_rotation
  implicit none (type, external)
  private

  public :: exact_rows, excess_of_point, excess_row, is_of_probe, moment_rows, new_ground_forces, rotations_of, rows_of, &
    & shifts_of, support_rows

  !> Names of the forces and moments on the ground, in the frame's order of degrees of freedom. A frame in the plane has the first
  !> three.
  character(len=2), parameter, public :: force_names(6) = [character(len=2) :: "fx", "fy", "m", "fz", "mx", "my"]

  !> For a frame in the plane, the number of the last row in each group of rows: displacements q, velocities q', accelerations
  !> q'', and forces of the guides.
  integer, parameter, public :: displacements = 3, velocities = 6, accelerations = 9, guide_forces = 12

  !> Denotes a further group of rows: the forces in the pairs of the mechanisms (gestell_model_pairs_rows). They are behind all
  !> other rows, from row `exact_rows` + 1 on. `joint_sources`: the same rows, and also the parts of the joint forces that have one
  !> source each.
  integer, parameter, public :: joint_forces = 15, joint_sources = 18

  !> A probe: a measuring point on the frame, at `position` and `z` in the frame's axes (m). `limit`: maximum permitted vibration
  !> velocity in any direction, as an rms value within the frequencies `band` (m/s, Hz); 0 means no limit.
  type, public :: probe_type
    character(len=word_length) :: name = ""
    real(dp) :: position(2) = 0, z = 0, limit = 0, band(2) = [10.0_dp, 1000.0_dp]
  end type probe_type

  !> A quantity that is linear in the motion: a weighted sum of the rows that describe the motion.
  type, public :: quantity_type
    !> Number of the frame's degrees of freedom, whether free or locked.
    integer :: dofs = 3
    !> True for forces in pairs: `weights` then has a weight for each row, including the joint forces.
    logical :: of_joints = .false.
    !> Name of the quantity as the user gave it.
    character(len=word_length) :: name = ""
    character(len=8) :: unit = ""
    !> Weight of each row of the exact frame's motion, shape (rows, 1). A magnitude has one column of weights for each of its
    !> components along x, y and, in space, z: shape (rows, 2) or (rows, 3).
    real(dp), allocatable :: weights(:, :)
    !> Bounds on the rounding errors of the weights, in the shape of `weights`. A bound remains large where a weight is small only
    !> because forces cancel.
    real(dp), allocatable :: rounding(:, :)
  contains
    procedure :: rows
  end type quantity_type

  !> Forces on the ground, and their moments about the rest position of the frame's centre of mass, in the frame's order of
  !> degrees of freedom. `weights`: weights of the rows of the motion. `rounding`: bounds on the rounding errors of the weights.
  !> Shapes (rows, dofs).
  type, public :: ground_forces_type
    real(dp), allocatable :: weights(:, :), rounding(:, :)
  end type ground_forces_type

contains

  !> True if `part` is the name probe(NAME) by which the user refers to this probe.
  pure logical function is_of_probe(part, probe)
    character(len=*), intent(in) :: part
    type(probe_type), intent(in) :: probe
    integer :: n

    n = len(part)
    is_of_probe = n > len("probe()")
    if (is_of_probe) is_of_probe = part(:6) == "probe(" .and. part(n:n) == ")" .and. part(7:n - 1) == probe%name
  end function is_of_probe

  !> Forces on the ground with all weights and bounds set to zero, in the shape that the frame requires.
  pure type(ground_forces_type) function new_ground_forces(frame) result(forces)
    class(frame_type), intent(in) :: frame

    allocate(forces%weights(exact_rows(frame), frame%dofs()), forces%rounding(exact_rows(frame), frame%dofs()), source=0.0_dp)
  end function new_ground_forces

  !> Indices of the displacements among the frame's degrees of freedom: those along xi, eta and, in space, zeta.
  pure function shifts_of(frame) result(shifts)
    class(frame_type), intent(in) :: frame
    integer, allocatable :: shifts(:)
    integer :: k

    shifts = pack([(k, k = 1, frame%dofs())], .not. is_rotation([(k, k = 1, frame%dofs())]))
  end function shifts_of

  !> Indices of the rotations among the frame's degrees of freedom. In the plane there is one rotation; in space the rotations are
  !> about xi, eta and zeta.
  pure function rotations_of(frame) result(rotations)
    class(frame_type), intent(in) :: frame
    integer, allocatable :: rotations(:)

    rotations = [3]
    if (frame%dofs() == 6) rotations = in_frame(4:)
  end function rotations_of

  !> Number of the row that precedes the nonlinear part of the rotation (`level` 0), of its first derivative (1) or of its second
  !> derivative (2).
  pure integer function excess_row(frame, level)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: level

    excess_row = rows_of(frame%dofs(), guide_forces) + level * merge(9, 2, frame%dofs() == 6)
  end function excess_row

  !> Contribution of the rotation's nonlinear part to the displacement of the point p: the weights of the rows of this part, shape
  !> (rows, axes). In the plane the contribution is s k x p + c p, where s = sin psi - psi, c = cos psi - 1, and k is the unit
  !> normal. In space it is (R - 1 - [theta]) p with the rotation matrix R of the rotation vector theta.
  pure function excess_of_point(frame, p) result(weights)
    class(frame_type), intent(in) :: frame
    real(dp), intent(in) :: p(3)
    real(dp), allocatable :: weights(:, :)
    integer :: i

    if (frame%dofs() == 3) then
      weights = reshape([-p(2), p(1), p(1), p(2)], [2, 2])
      return
    end if
    allocate(weights(9, 3), source=0.0_dp)
    do i = 1, 3
      weights(i::3, i) = p
    end do
  end function excess_of_point

  !> Numbers of the rows that contain the nonlinear part of the supports' moments on the ground.
  pure function moment_rows(frame) result(rows)
    class(frame_type), intent(in) :: frame
    integer, allocatable :: rows(:)
    integer :: k

    rows = [(excess_row(frame, 3) + k, k = 1, size(rotations_of(frame)))]
  end function moment_rows

  !> Numbers of the rows that contain the nonlinear part of the force of support `number`, whose axes must turn with the frame.
  pure function support_rows(frame, number) result(rows)
    class(frame_type), intent(in) :: frame
    integer, intent(in) :: number
    integer, allocatable :: rows(:)
    integer :: axes, k

    axes = size(shifts_of(frame))
    rows = excess_row(frame, 3) + size(rotations_of(frame)) + axes * count(frame%supports(:number - 1)%turning) + [(k, k = 1, axes)]
  end function support_rows

  !> Number of rows of the exact frame's motion, including the nonlinear parts.
  pure integer function exact_rows(frame)
    class(frame_type), intent(in) :: frame

    exact_rows = excess_row(frame, 3) + size(rotations_of(frame)) + size(shifts_of(frame)) * count(frame%supports%turning)
  end function exact_rows

  !> Number of the last row of a group for a frame with `dofs` degrees of freedom. `last`: `displacements`, `velocities`,
  !> `accelerations` or `guide_forces`.
  pure integer function rows_of(dofs, last)
    integer, intent(in) :: dofs, last

    rows_of = last / 3 * dofs
  end function rows_of

  !> Last group of rows that is needed to compute the quantity: `velocities`, `accelerations`, `guide_forces` or `joint_forces`. The
  !> result is `velocities` also if only displacements are needed. For the exact frame the motion has all rows, whatever the result.
  pure integer function rows(self)
    class(quantity_type), intent(in) :: self
    integer :: k

    rows = merge(joint_forces, velocities, self%of_joints)
    if (self%of_joints) return
    do k = rows_of(self%dofs, velocities) + 1, rows_of(self%dofs, guide_forces)
      if (any(abs(self%weights(k, :)) > 0)) rows = merge(accelerations, guide_forces, k <= rows_of(self%dofs, accelerations))
    end do
  end function rows

end module gestell_model_quantity_rows
