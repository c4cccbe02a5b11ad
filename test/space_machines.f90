!> Machines in space for tests; validation/space has the same machines as inputs.
module space_machines
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_placement, only: placement_type
  use gestell_model_linkage, only: linkage_type
  use gestell_model_frame, only: frame_type, new_frame
  use gestell_model_frame_in_space, only: put_in_space
  use gestell_model_space_masses, only: plane_type
  use gestell_model_mounting, only: support_type
  use gestell_math_rotation, only: cross, rotation_matrix
  implicit none (type, external)
  private

  public :: engine, four_bar_plane, new_space_frame, three_planes, v_twin

  real(dp), parameter :: degree = pi / 180
  integer, parameter :: all_free(6) = [1, 2, 3, 4, 5, 6]

contains

  !> A frame with these planes; its own mechanism is that of the first.
  subroutine new_space_frame(frame, mass, inertia, planes, supports, speed, free, error)
    type(frame_type), intent(out) :: frame
    real(dp), intent(in) :: mass, inertia(3, 3), speed
    type(plane_type), intent(in) :: planes(:)
    type(support_type), intent(in) :: supports(:)
    integer, intent(in) :: free(:)
    type(gestell_error), allocatable, intent(out) :: error
    real(dp) :: none(3, 3)

    none = 0
    call new_frame(frame, planes(1)%linkage, mass, inertia(3, 3), planes(1)%origin(:2), none, none, speed, error)
    if (.not. allocated(error)) call put_in_space(frame, inertia, planes, supports, free, error)
  end subroutine new_space_frame

  !> validation/space/v_twin.nml at a speed (rad/s).
  subroutine v_twin(speed, frame, error)
    real(dp), intent(in) :: speed
    type(frame_type), intent(out) :: frame
    type(gestell_error), allocatable, intent(out) :: error
    type(plane_type) :: planes(2)
    type(support_type) :: supports(4)
    real(dp), parameter :: x(4) = [0.22_dp, -0.22_dp, 0.20_dp, -0.20_dp], z(4) = [0.16_dp, 0.16_dp, -0.18_dp, -0.18_dp], &
      & yaw(4) = [45.0_dp, -45.0_dp, 45.0_dp, -45.0_dp], pitch(4) = [0.0_dp, 0.0_dp, 20.0_dp, -20.0_dp]
    integer :: i

    do i = 1, 2
      call cylinder(planes(i)%linkage, error)
      if (allocated(error)) return
      call set_crank(planes(i)%linkage, placement_type(phase=merge(45, -45, i == 1) * degree))
      planes(i)%axes = turned_axes([merge(-45.0_dp, 45.0_dp, i == 1), 0.0_dp, 0.0_dp])
      planes(i)%origin = [0.02_dp, -0.07_dp, merge(0.011_dp, -0.011_dp, i == 1)]
      planes(i)%linkage%links%along = [0.006_dp, 1.5e-4_dp, 3.0e-4_dp]
      planes(i)%linkage%links%across = [0.006_dp, 1.3e-3_dp, 2.5e-4_dp]
    end do
    do i = 1, 4
      supports(i) = support_type([x(i), -0.17_dp, z(i)], [7.0e4_dp, 1.3e5_dp, 6.0e4_dp], [50.0_dp, 80.0_dp, 50.0_dp], &
        & turned_axes([yaw(i), pitch(i), 0.0_dp]))
    end do
    call new_space_frame(frame, 58.0_dp, tensor([1.9_dp, 1.6_dp, 1.7_dp, 0.05_dp, -0.06_dp, 0.08_dp]), planes, supports, speed, &
      & all_free, error)
  end subroutine v_twin

  !> Cylinders on a crankshaft along zeta: the angles of their pins and banks (deg), their places along the shaft (m).
  subroutine engine(pins, banks, places, planes, error)
    real(dp), intent(in) :: pins(:), banks(:), places(:)
    type(plane_type), allocatable, intent(out) :: planes(:)
    type(gestell_error), allocatable, intent(out) :: error
    integer :: i

    allocate(planes(size(pins)))
    do i = 1, size(pins)
      call cylinder(planes(i)%linkage, error)
      if (allocated(error)) return
      call planes(i)%linkage%prepare(error)
      if (allocated(error)) return
      call set_crank(planes(i)%linkage, placement_type(phase=(pins(i) - banks(i)) * degree))
      planes(i)%axes = turned_axes([banks(i), 0.0_dp, 0.0_dp])
      planes(i)%origin = [0.0_dp, 0.0_dp, places(i)]
      planes(i)%linkage%links%along = [0.006_dp, 1.5e-4_dp, 3.0e-4_dp]
      planes(i)%linkage%links%across = [0.006_dp, 1.3e-3_dp, 2.5e-4_dp]
    end do
  end subroutine engine

  !> A crank slider upright.
  subroutine cylinder(linkage, error)
    type(linkage_type), intent(out) :: linkage
    type(gestell_error), allocatable, intent(out) :: error

    call linkage%ground("O", [0.0_dp, 0.0_dp], error)
    if (.not. allocated(error)) call linkage%crank("A", "O", 0.040_dp, 0.0_dp, error)
    if (.not. allocated(error)) call linkage%rrp("B", "A", 0.140_dp, guide_type(point=[0.0_dp, 0.0_dp], angle=pi / 2), 1, error)
    if (.not. allocated(error)) call linkage%link("crank", "O", "A", 3.60_dp, 0.009_dp, [-0.00682_dp, 0.0_dp], error)
    if (.not. allocated(error)) call linkage%link("rod", "A", "B", 0.44_dp, 1.4e-3_dp, [0.042_dp, 0.0_dp], error)
    if (.not. allocated(error)) call linkage%link("piston", "B", "", 0.48_dp, 3.0e-4_dp, [0.0_dp, 0.0_dp], error)
  end subroutine cylinder

  !> validation/space/two_planes.nml at a speed (rad/s) with a factor of its damping; the drive here turns half as fast, so that all
  !> ratios are whole.
  subroutine three_planes(speed, damping, frame, error)
    real(dp), intent(in) :: speed, damping
    type(frame_type), intent(out) :: frame
    type(gestell_error), allocatable, intent(out) :: error
    type(plane_type) :: planes(3)
    type(support_type) :: supports(4)
    real(dp), parameter :: places(3, 4) = reshape([0.30_dp, -0.20_dp, 0.20_dp, -0.30_dp, -0.20_dp, 0.20_dp, 0.25_dp, -0.20_dp, &
      & -0.25_dp, -0.25_dp, 0.20_dp, -0.20_dp], [3, 4]), angles(3, 4) = reshape([20.0_dp, 10.0_dp, -15.0_dp, -20.0_dp, 30.0_dp, &
      & 5.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, 40.0_dp], [3, 4])
    real(dp) :: x(3), n(3)
    integer :: i

    call four_bar_plane(planes(1), error)
    if (.not. allocated(error)) call four_bar_plane(planes(2), error)
    if (.not. allocated(error)) call lever(planes(3), error)
    if (allocated(error)) return
    call set_crank(planes(1)%linkage, placement_type(phase=15 * degree, ratio=2))
    planes(1)%axes = tilted([1.0_dp, 2.0_dp, 2.0_dp], 20.0_dp)
    planes(1)%origin = [-0.10_dp, 0.12_dp, 0.05_dp]
    call set_crank(planes(2)%linkage, placement_type(phase=-40 * degree, ratio=3))
    n = [0.0_dp, -1.0_dp, 0.5_dp] / norm2([0.0_dp, -1.0_dp, 0.5_dp])
    x = [1.0_dp, 0.2_dp, 0.0_dp]
    x = x - dot_product(x, n) * n
    x = x / norm2(x)
    planes(2)%axes = reshape([x, cross(n, x), n], [3, 3])
    planes(2)%origin = [0.12_dp, -0.05_dp, -0.10_dp]
    call set_crank(planes(3)%linkage, placement_type(ratio=-2))
    planes(3)%axes = reshape([1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, -1.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, -1.0_dp], [3, 3])
    planes(3)%origin = [0.05_dp, 0.10_dp, -0.08_dp]
    do i = 1, 4
      supports(i) = support_type(places(:, i), [4.0e4_dp, 6.0e4_dp, 3.0e4_dp], damping * [50.0_dp, 60.0_dp, 40.0_dp], &
        & turned_axes(angles(:, i)))
    end do
    call new_space_frame(frame, 26.0_dp, tensor([0.9_dp, 0.8_dp, 1.0_dp, 0.05_dp, -0.08_dp, 0.06_dp]), planes, supports, &
      & speed / 2, all_free, error)
  end subroutine three_planes

  !> A four-bar whose coupler and rocker lie outside its plane.
  subroutine four_bar_plane(plane, error)
    type(plane_type), intent(out) :: plane
    type(gestell_error), allocatable, intent(out) :: error

    associate (linkage => plane%linkage)
      call linkage%ground("A0", [0.0_dp, 0.0_dp], error)
      if (.not. allocated(error)) call linkage%ground("B0", [0.40_dp, 0.0_dp], error)
      if (.not. allocated(error)) call linkage%crank("A", "A0", 0.07_dp, 0.0_dp, error)
      if (.not. allocated(error)) call linkage%rrr("B", ["A ", "B0"], [0.37_dp, 0.16_dp], 1, error)
      if (.not. allocated(error)) call linkage%link("crank", "A0", "A", 0.50_dp, 0.0035_dp, [0.03_dp, 0.0_dp], error)
      if (.not. allocated(error)) call linkage%link("coupler", "A", "B", 0.60_dp, 0.0070_dp, [0.18_dp, 0.01_dp], error)
      if (.not. allocated(error)) call linkage%link("rocker", "B0", "B", 0.25_dp, 0.0060_dp, [0.08_dp, 0.0_dp], error)
    end associate
    plane%linkage%links%z = [0.0_dp, 0.02_dp, -0.01_dp]
    plane%linkage%links%along = [0.0_dp, 0.001_dp, 0.0_dp]
    plane%linkage%links%across = [0.0035_dp, 0.0065_dp, 0.0060_dp]
  end subroutine four_bar_plane

  !> A slotted lever.
  subroutine lever(plane, error)
    type(plane_type), intent(out) :: plane
    type(gestell_error), allocatable, intent(out) :: error

    associate (linkage => plane%linkage)
      call linkage%ground("O", [0.0_dp, 0.0_dp], error)
      if (.not. allocated(error)) call linkage%ground("Q", [0.0_dp, -0.15_dp], error)
      if (.not. allocated(error)) call linkage%crank("A", "O", 0.05_dp, 30 * degree, error)
      if (.not. allocated(error)) call linkage%rpr("T", ["A", "Q"], 0.30_dp, 1, error)
      if (.not. allocated(error)) call linkage%link("crank", "O", "A", 0.80_dp, 0.0008_dp, [0.02_dp, 0.0_dp], error)
      if (.not. allocated(error)) call linkage%link("block", "A", "Q", 0.20_dp, 0.0002_dp, [0.0_dp, 0.0_dp], error)
      if (.not. allocated(error)) call linkage%link("lever", "Q", "T", 0.90_dp, 0.0070_dp, [0.14_dp, 0.0_dp], error)
    end associate
    plane%linkage%links%z = [0.0_dp, 0.02_dp, 0.02_dp]
    plane%linkage%links%along = [0.0_dp, 0.0001_dp, 0.0001_dp]
    plane%linkage%links%across = [0.0008_dp, 0.0002_dp, 0.0070_dp]
  end subroutine lever

  !> Sets how the crank of a linkage turns with the drive.
  subroutine set_crank(linkage, placement)
    type(linkage_type), intent(inout) :: linkage
    type(placement_type), intent(in) :: placement
    integer :: i

    do i = 1, size(linkage%joints)
      call linkage%joints(i)%joint%move(placement)
    end do
  end subroutine set_crank

  !> Axes with the normal `n`, by the shortest turn from zeta, then turned about it by an angle (deg).
  pure function tilted(n, angle) result(axes)
    real(dp), intent(in) :: n(3), angle
    real(dp) :: axes(3, 3), unit(3), by(3)

    unit = n / norm2(n)
    by = [-unit(2), unit(1), 0.0_dp]
    axes = matmul(rotation_matrix(unit * angle * degree), rotation_matrix(by / norm2(by) * acos(unit(3))))
  end function tilted

  !> Axes turned by yaw about zeta, pitch about the new second, roll about the new first (deg).
  pure function turned_axes(angles) result(axes)
    real(dp), intent(in) :: angles(3)
    real(dp) :: axes(3, 3)

    axes = matmul(rotation_matrix([0.0_dp, 0.0_dp, angles(1) * degree]), matmul(rotation_matrix([0.0_dp, angles(2) * degree, &
      & 0.0_dp]), rotation_matrix([angles(3) * degree, 0.0_dp, 0.0_dp])))
  end function turned_axes

  !> Symmetric tensor from its elements xx, yy, zz, xy, xz, yz.
  pure function tensor(j)
    real(dp), intent(in) :: j(6)
    real(dp) :: tensor(3, 3)

    tensor = reshape([j(1), j(4), j(5), j(4), j(2), j(6), j(5), j(6), j(3)], [3, 3])
  end function tensor

end module space_machines
