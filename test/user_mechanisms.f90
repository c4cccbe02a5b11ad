!> Joints and a mechanism as a user writes them: only the required procedures, none for speed.
module user_mechanisms
  use gestell_math_jet, only: cos, jet, operator(*), operator(+), sin
  use gestell_base_kinds, only: dp
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_joints_joint, only: form_type, itself, joint_type, point_type, reach_type
  use gestell_model_mechanism, only: mass_functions_type, mechanism_type
  implicit none (type, external)
  private

  public :: count_angles

  !> A point that turns with the crank about another joint.
  type, extends(joint_type), public :: handle_joint
    integer :: pivot = 0
    real(dp) :: radius = 0
  contains
    procedure :: describe
    procedure :: locate
    procedure :: reach
  end type handle_joint

  !> A fixed point that states its bounds only within this angle (rad).
  type, extends(joint_type), public :: timid_joint
    real(dp) :: sure = 0
  contains
    procedure :: describe => describe_timid
    procedure :: locate => locate_timid
    procedure :: reach => reach_timid
  end type timid_joint

  !> A point in the middle between two others of one body.
  type, extends(joint_type), public :: midpoint_joint
    integer :: ends(2) = 0
  contains
    procedure :: describe => describe_midpoint
    procedure :: locate => locate_midpoint
    procedure :: reach => reach_midpoint
  end type midpoint_joint

  !> A tappet on a fixed guide, at 2 + `stroke` cos phi (m) from the guide's point: a cam on the crank's shaft lifts it.
  type, extends(joint_type), public :: tappet_joint
    type(guide_type) :: guide
    real(dp) :: stroke = 0
  contains
    procedure :: describe => describe_tappet
    procedure :: check => check_tappet
    procedure :: locate => locate_tappet
    procedure :: reach => reach_tappet
  end type tappet_joint

  !> Another mechanism, with a count of the crank angles at which its masses were evaluated.
  type, extends(mechanism_type) :: counted_type
    class(mechanism_type), allocatable :: inner
    integer, pointer :: angles => null()
  contains
    procedure :: mass_functions => counted_functions
    procedure :: tabulate => counted_table
    procedure :: tabulate_drive => counted_drive
  end type counted_type

  !> a1 = cos phi, a2 = 2 sin phi, a3 = 5 + cos 2 phi, a4 = sin 3 phi.
  type, extends(mechanism_type), public :: pendulum_type
  contains
    procedure :: mass_functions
  end type pendulum_type

contains

  !> A link of its own, turning about the other joint.
  pure subroutine describe(self, form)
    class(handle_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("handle", "turns with the crank about another joint", links=1, pairs=1, bars=[self%pivot, itself])
  end subroutine describe

  pure subroutine describe_timid(self, form)
    class(timid_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    associate (unused => self)
    end associate
    form = form_type("timid", "stands still", links=0, pairs=0)
  end subroutine describe_timid

  pure subroutine locate(self, crank_angle, points, here)
    class(handle_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    here%x = points(self%pivot)%x + self%radius * cos(jet(crank_angle, 1.0_dp, 0.0_dp))
    here%y = points(self%pivot)%y + self%radius * sin(jet(crank_angle, 1.0_dp, 0.0_dp))
  end subroutine locate

  pure function reach(self, points, speeds, accelerations, half_width)
    class(handle_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_width => half_width)
    end associate
    reach%speed = speeds(self%pivot) + self%radius
    reach%acceleration = accelerations(self%pivot) + self%radius
  end function reach

  pure subroutine locate_timid(self, crank_angle, points, here)
    class(timid_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    associate (unused => self, unused_angle => crank_angle, unused_points => points)
      here = point_type()
    end associate
  end subroutine locate_timid

  pure function reach_timid(self, points, speeds, accelerations, half_width) result(reach)
    class(timid_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_speeds => speeds, unused => accelerations)
      reach%assembled = half_width < self%sure
    end associate
  end function reach_timid

  pure subroutine describe_midpoint(self, form)
    class(midpoint_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("midpoint", "lies in the middle of its ends", links=0, pairs=0, &
      & bars=[self%ends(1), itself, self%ends(2), itself])
  end subroutine describe_midpoint

  pure subroutine locate_midpoint(self, crank_angle, points, here)
    class(midpoint_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here

    associate (unused => crank_angle, one => points(self%ends(1)), two => points(self%ends(2)))
      here%x = 0.5_dp * (one%x + two%x)
      here%y = 0.5_dp * (one%y + two%y)
    end associate
  end subroutine locate_midpoint

  pure function reach_midpoint(self, points, speeds, accelerations, half_width) result(reach)
    class(midpoint_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_width => half_width)
    end associate
    reach%speed = sum(speeds(self%ends)) / 2
    reach%acceleration = sum(accelerations(self%ends)) / 2
  end function reach_midpoint

  !> One link more; it slides on its guide, and rolls and slides on the cam.
  pure subroutine describe_tappet(self, form)
    class(tappet_joint), intent(in) :: self
    type(form_type), intent(out) :: form

    form = form_type("tappet", "rides on a cam", links=1, pairs=1, higher_pairs=1, guides=[self%guide])
  end subroutine describe_tappet

  pure subroutine check_tappet(self, reason)
    class(tappet_joint), intent(in) :: self
    character(len=:), allocatable, intent(inout) :: reason

    call self%guide%check(reason)
  end subroutine check_tappet

  pure subroutine locate_tappet(self, crank_angle, points, here)
    class(tappet_joint), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(point_type), intent(in) :: points(:)
    type(point_type), intent(out) :: here
    type(point_type) :: origin, along
    type(jet) :: lift

    call self%guide%line(points, origin, along)
    lift = self%stroke * cos(jet(crank_angle, 1.0_dp, 0.0_dp)) + 2.0_dp
    here%x = origin%x + lift * along%x
    here%y = origin%y + lift * along%y
  end subroutine locate_tappet

  pure function reach_tappet(self, points, speeds, accelerations, half_width) result(reach)
    class(tappet_joint), intent(in) :: self
    type(point_type), intent(in) :: points(:)
    real(dp), intent(in) :: speeds(:), accelerations(:), half_width
    type(reach_type) :: reach

    associate (unused_points => points, unused_speeds => speeds, unused => accelerations, unused_width => half_width)
    end associate
    reach%speed = self%stroke
    reach%acceleration = self%stroke
  end function reach_tappet

  subroutine mass_functions(self, crank_angle, a)
    class(pendulum_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a

    associate (unused => self, phi => crank_angle)
      a%a1 = jet(cos(phi), -sin(phi), -cos(phi))
      a%a2 = jet(2 * sin(phi), 2 * cos(phi), -2 * sin(phi))
      a%a3 = jet(5 + cos(2 * phi), -2 * sin(2 * phi), -4 * cos(2 * phi))
      a%a4 = sin(3 * phi)
    end associate
  end subroutine mass_functions

  !> Counts in `angles` from now on at how many crank angles the masses of `mechanism` are evaluated.
  subroutine count_angles(mechanism, angles)
    class(mechanism_type), allocatable, intent(inout) :: mechanism
    integer, target, intent(inout) :: angles
    type(counted_type), allocatable :: counted

    allocate(counted)
    counted%mass = mechanism%mass
    counted%inertia = mechanism%inertia
    counted%angle_scale = mechanism%angle_scale
    counted%terms = mechanism%terms
    counted%turns = mechanism%turns
    counted%angles => angles
    call move_alloc(mechanism, counted%inner)
    call move_alloc(counted, mechanism)
  end subroutine count_angles

  subroutine counted_functions(self, crank_angle, a)
    class(counted_type), intent(in) :: self
    real(dp), intent(in) :: crank_angle
    type(mass_functions_type), intent(out) :: a

    call self%inner%mass_functions(crank_angle, a)
    self%angles = self%angles + 1
  end subroutine counted_functions

  subroutine counted_table(self, angles, table)
    class(counted_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)

    call self%inner%tabulate(angles, table)
    self%angles = self%angles + size(angles)
  end subroutine counted_table

  subroutine counted_drive(self, angles, table, known)
    class(counted_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    logical, intent(out) :: known

    call self%inner%tabulate_drive(angles, table, known)
  end subroutine counted_drive

end module user_mechanisms
