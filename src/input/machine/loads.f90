!> Reads the foundation and gravity from an input file.
module gestell_input_machine_loads
  use gestell_base_error, only: error_type
  use gestell_base_key, only: fraction, key_type, nonnegative, of_acceleration, of_angle, of_damping_diagonal, &
    & of_stiffness_matrix, real_key
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_input_namelist_document, only: find_entry, group_type
  use gestell_input_namelist_message, only: input_error
  use gestell_input_schema_read, only: count_values, read
  use gestell_input_schema_units, only: units_type
  implicit none (type, external)
  private

  public :: read_foundation, read_gravity

  type(key_type), parameter, public :: foundation_keys(*) = [ &
    & key_type("foundation", "stiffness", real_key, "stiffness matrix about the frame's centre of mass F, added to the " // &
    &   "stiffness of the supports. It must be symmetric and positive semidefinite. Its rows and columns stand for xi, eta, " // &
    &   "psi (for a frame in space also zeta, rot_xi, rot_eta)", 2, &
    &   36, 36, shorter=9, unit=of_stiffness_matrix, default=0.0_dp, rows=6), &
    & key_type("foundation", "damping", real_key, "damping coefficients of xi, eta, psi (for a frame in space also zeta, " // &
    &   "rot_xi, rot_eta) about the frame's centre of mass F; they are added to the diagonal of the supports' damping matrix", &
    &   1, 6, 6, shorter=3, unit=of_damping_diagonal, default=0.0_dp, range=nonnegative), &
    & key_type("foundation", "damping_ratio", real_key, "damping ratio of the whole mounting: each of its modes gets this " // &
    &   "ratio, in addition to `damping` and to the damping of the supports", default=0.0_dp, range=fraction)]

  type(key_type), parameter, public :: gravity_keys(*) = [ &
    & key_type("gravity", "acceleration", real_key, "acceleration of gravity; with `0` nothing has weight", unit=of_acceleration, &
    &   default=9.80665_dp, range=nonnegative), &
    & key_type("gravity", "direction", real_key, "direction of gravity in the frame's axes: its angle from the xi-axis (`-90` " // &
    &   "means opposite to eta); for a frame in space also a vector of any length, with components along xi, eta, zeta", 1, 1, &
    &   3, unit=of_angle, default=-90.0_dp)]

contains

  !> Reads the stiffness and damping matrices of the foundation in SI units. Fails if the stiffness matrix is not symmetric or not
  !> positive semidefinite. Also fails if elements for zeta, rot_xi or rot_eta are given although the frame moves in its plane.
  subroutine read_foundation(group, units, in_space, stiffness, damping, ratio, error)
    type(group_type), intent(in) :: group
    type(units_type), intent(in) :: units
    !> True if the frame moves in three dimensions, not only in its plane
    logical, intent(in) :: in_space
    !> Matrices of the foundation, in the order of the frame's degrees of freedom
    real(dp), intent(out) :: stiffness(6, 6), damping(6, 6)
    !> Damping ratio of each mode of the mounting
    real(dp), intent(out) :: ratio
    type(error_type), allocatable, intent(out) :: error
    real(dp) :: b(6)
    integer :: i, k, row, column

    damping = 0
    ratio = 0
    if (.not. in_space) call refuse_space_elements(group, error)
    call read(group, foundation_keys, "stiffness", stiffness, error)
    if (allocated(error)) return
    do k = 2, 6
      do i = 1, k - 1
        if (.not. abs(stiffness(i, k) - stiffness(k, i)) > 0) cycle
        row = merge(i, k, i + k /= 4)
        column = i + k - row
        call input_error(group, "stiffness", "must be symmetric, but c" // text(row) // text(column) // " is " &
          & // concise(stiffness(row, column)) // " and c" // text(column) // text(row) // " is " &
          & // concise(stiffness(column, row)), error, element=row + 6 * (column - 1))
        return
      end do
    end do
    call read(group, foundation_keys, "stiffness", stiffness, error, units)
    if (has_negative_eigenvalue(stiffness)) then
      call input_error(group, "stiffness", "must be positive semidefinite: in some direction this matrix pushes a displaced " // &
        &   "frame farther away instead of back", error)
      return
    end if
    call read(group, foundation_keys, "damping", b, error, units)
    call read(group, foundation_keys, "damping_ratio", ratio, error)
    if (allocated(error)) return
    do i = 1, 6
      damping(i, i) = b(i)
    end do
  end subroutine read_foundation

  !> Fails if the group &foundation contains an element for zeta, rot_xi or rot_eta. Only a frame that moves in three dimensions has
  !> these degrees of freedom.
  subroutine refuse_space_elements(group, error)
    type(group_type), intent(in) :: group
    type(error_type), allocatable, intent(out) :: error
    character(len=9), parameter :: names(2) = [character(len=9) :: "stiffness", "damping"]
    integer :: i, k, n

    do k = 1, 2
      i = find_entry(group, trim(names(k)))
      if (i == 0) cycle
      do n = 1, size(group%entries(i)%values)
        if (.not. allocated(group%entries(i)%values(n)%text)) cycle
        if (merge(max(1 + mod(n - 1, 6), 1 + (n - 1) / 6), n, k == 1) <= 3) cycle
        call input_error(group, trim(names(k)), "is allowed only for a frame in space: add zeta, rot_xi or rot_eta to &frame " // &
          &   "dof", error, n)
        return
      end do
    end do
  end subroutine refuse_space_elements

  !> True if a symmetric matrix has an eigenvalue more negative than rounding errors explain. The matrix is scaled to a unit
  !> diagonal and eliminated with the largest diagonal element as pivot: a negative pivot reveals a negative eigenvalue.
  pure logical function has_negative_eigenvalue(c)
    real(dp), intent(in) :: c(6, 6)
    real(dp), parameter :: rounding = 1.0e-12_dp
    real(dp) :: a(6, 6), unit(6)
    integer :: i, k, at, row(6)

    has_negative_eigenvalue = any([(c(i, i) < 0, i = 1, 6)])
    if (has_negative_eigenvalue) return
    unit = sqrt([(c(i, i), i = 1, 6)])
    where (.not. unit > 0) unit = 1
    a = c / (spread(unit, 2, 6) * spread(unit, 1, 6))
    row = [(i, i = 1, 6)]
    do k = 1, 6
      at = k - 1 + maxloc([(a(row(i), row(i)), i = k, 6)], dim=1)
      row([k, at]) = row([at, k])
      has_negative_eigenvalue = any([(a(row(i), row(i)) < -rounding, i = k, 6)])
      if (has_negative_eigenvalue) return
      if (.not. a(row(k), row(k)) > rounding) exit
      do i = k + 1, 6
        a(row(i), row(k + 1:)) = a(row(i), row(k + 1:)) - a(row(i), row(k)) / a(row(k), row(k)) * a(row(k), row(k + 1:))
      end do
    end do
    ! if the remaining diagonal is zero, the other remaining elements must be zero too
    do i = k, 6
      has_negative_eigenvalue = has_negative_eigenvalue .or. any(abs(a(row(i), row(k:))) > sqrt(rounding))
    end do
  end function has_negative_eigenvalue

  !> Reads the acceleration of gravity, which is zero if the group &gravity is missing. Fails if its direction is a vector although
  !> the frame moves in its plane. Also fails if this vector is zero or has only 2 components.
  subroutine read_gravity(groups, units, in_space, gravity, error)
    !> The groups &gravity of the input: an empty array or one group
    type(group_type), intent(in) :: groups(:)
    type(units_type), intent(in) :: units
    !> True if the frame moves in three dimensions, not only in its plane
    logical, intent(in) :: in_space
    !> Components of the acceleration of gravity along xi, eta, zeta (m/s^2)
    real(dp), intent(out) :: gravity(3)
    type(error_type), allocatable, intent(out) :: error
    !> Components of the unit vector along gravity that are smaller than this are set to zero. They are rounding errors of sine
    !> and cosine if gravity acts along an axis.
    real(dp), parameter :: rounding = 4 * epsilon(1.0_dp)
    real(dp) :: acceleration, angle(1)
    integer :: n

    gravity = 0
    if (size(groups) == 0) return
    call read(groups(1), gravity_keys, "acceleration", acceleration, error, units)
    if (allocated(error)) return
    n = count_values(groups(1), "direction")
    if (n > 1) then
      call read(groups(1), gravity_keys, "direction", gravity, error)
      if (.not. in_space) then
        call input_error(groups(1), "direction", "must be one angle, because the frame moves in a plane; to give a vector, " // &
          &   "add zeta, rot_xi or " // "rot_eta to &frame dof", error)
      else if (n == 2) then
        call input_error(groups(1), "direction", "must be one angle or a vector of 3 values, but has 2 values", error)
      else if (.not. maxval(abs(gravity)) > 0) then
        call input_error(groups(1), "direction", "must not be the zero vector", error)
      end if
      if (allocated(error)) return
      gravity = gravity / maxval(abs(gravity))
      gravity = acceleration * gravity / norm2(gravity)
    else
      call read(groups(1), gravity_keys, "direction", angle, error, units)
      if (allocated(error)) return
      gravity(:2) = [cos(angle(1)), sin(angle(1))]
      gravity = acceleration * merge(gravity, 0.0_dp, abs(gravity) > rounding)
    end if
  end subroutine read_gravity

end module gestell_input_machine_loads
