!> The moving masses of a mechanism: sums over its links as functions of the crank angle. The model of a frame uses no other data of
!> its mechanism.
module gestell_model_mechanism
  use gestell_base_error, only: error_type
  use gestell_math_jet, only: jet
  use gestell_base_kinds, only: dp
  implicit none (type, external)
  private

  !> Mass functions at one crank angle: the sums (4) to (7) of doc/theory.md and their derivatives with respect to the crank angle.
  type, public :: mass_functions_type
    !> a1 = sum m x, a2 = sum m y (kg m), a3 = sum m (x^2 + y^2) (kg m^2).
    type(jet) :: a1 = jet(), a2 = jet(), a3 = jet()
    !> a4 = sum [m (x y'' - y x'') + J phi''] (kg m^2). In the paper on which doc/theory.md is based, a4 is Omega^2 times this
    !> sum.
    real(dp) :: a4 = 0
  end type mass_functions_type

  !> Columns of a table of the mass functions, shape (angles, table_columns). Suffix _v: value. Suffixes _d, _dd: first and second
  !> derivatives.
  integer, parameter, public :: a1_v = 1, a1_d = 2, a1_dd = 3, a2_v = 4, a2_d = 5, a2_dd = 6, a3_v = 7, a3_d = 8, &
    & a3_dd = 9, a4_v = 10, table_columns = 10

  !> Columns of a table of the drive's functions, shape (angles, drive_columns). `spin`: H = sum [m (x y' - y x') + J phi'], so that
  !> a4 = H'. `energy`: K = sum [m (x'^2 + y'^2) + J phi'^2], twice the kinetic energy at unit speed (both kg m^2). Suffixes _d,
  !> _dd, _ddd: derivatives. The last four columns are needed only for a crank that turns uniformly relative to the ground
  !> (gestell_model_mechanism_held).
  integer, parameter, public :: spin_v = 1, energy_v = 2, energy_d = 3, spin_dd = 4, energy_dd = 5, a1_ddd = 6, a2_ddd = 7, &
    & drive_columns = 7

  !> Sums over the loads (forces and moments between links, frame and ground) at one crank angle phi. Vectors of the plane are
  !> complex numbers along the frame's axes. Element 0: value; element 1: derivative with respect to phi. F on body 2, -F on body
  !> 1. Loads against the ground act at r relative to the frame's centre of mass; E = exp(i psi) with the rotation psi of the frame.
  type, public :: load_sums_type
    !> `torque`: sum of F (r_2 - r_1)' + M (phi_2 - phi_1)', ' = d/dphi, of all loads but those whose direction is fixed in space (N
    !> m). Only against the ground: `force`: sum of the forces F that turn with the frame (N); `moment`: sum of r x F + M (N m)
    real(dp) :: torque(0:1) = 0, moment(0:1) = 0
    complex(dp) :: force(0:1) = (0.0_dp, 0.0_dp)
    !> Forces whose direction is fixed in space: sums of F (N), conjg(r) F and conjg(r') F (N m). With the rotation of the frame
    !> their moment about F is Im(conjg(E) lever), and their torque on the crank Re(conjg(E) sweep)
    complex(dp) :: fixed(0:1) = (0.0_dp, 0.0_dp), lever(0:1) = (0.0_dp, 0.0_dp), sweep(0:1) = (0.0_dp, 0.0_dp)
  end type load_sums_type

  !> A mechanism driven by one crank. Extend this type for a mechanism that is not a linkage.
  type, abstract, public :: mechanism_type
    !> `mass`: total mass m_G (kg). `inertia`: sum of the moments of inertia J_i about the links' centres of mass (kg m^2).
    real(dp) :: mass = 0, inertia = 0
    !> Crank angle over which the mass functions change noticeably (rad). Integration steps should not be much longer.
    real(dp) :: angle_scale = 1
    !> Sums over the links of the absolute values of the terms of a1'', a2'' (kg m), a4 and K' (kg m^2); each sum is the maximum
    !> over the turn. They bound the rounding errors where the terms cancel. A sum is zero if no terms cancel.
    real(dp) :: terms(4) = 0
    !> Number of turns of the drive in the period; the period is one turn of the crank angle. The number exceeds 1 if some shaft
    !> does not turn a whole number of times per turn of the drive: the crank angle is then the angle of an imaginary slower shaft.
    !> Orders are multiples k/`turns` of the drive speed.
    integer :: turns = 1
    !> Number of turns of each crank in the period, regardless of direction; not allocated if the period is one turn of the drive.
    integer, allocatable :: crank_turns(:)
    !> Highest order of the loads, in cycles per period; -1 if there are no loads.
    integer :: load_order = -1
    !> True if a load acts between a link or the frame and the ground.
    logical :: has_ground_loads = .false.
    !> Crank angles (rad), ascending and strictly between 0 and 2 pi, at which the motion is not smooth. Not allocated if it is
    !> smooth everywhere.
    real(dp), allocatable :: kinks(:)
    !> True if accelerations jump at some of these angles or at the angle 0.
    logical :: jumps = .false.
    !> False if the mechanism has no crank, because cylinders alone move it. A cylinder has no shaft.
    logical :: has_crank = .true.
  contains
    procedure(mass_functions_at), deferred :: mass_functions
    procedure :: tabulate => tabulate_one_by_one
    procedure :: tabulate_drive => default_tabulate_drive
    procedure :: sum_loads => default_sum_loads
    procedure :: prepare => default_prepare
    procedure :: check => default_check
    procedure :: link_offset => default_link_offset
    procedure :: harmonics
  end type mechanism_type

  abstract interface
    !> Computes the mass functions at a crank angle (rad).
    subroutine mass_functions_at(self, crank_angle, a)
      import :: mechanism_type, mass_functions_type, dp
      implicit none (type, external)
      class(mechanism_type), intent(in) :: self
      real(dp), intent(in) :: crank_angle
      type(mass_functions_type), intent(out) :: a
    end subroutine mass_functions_at
  end interface

contains

  !> Tabulates the mass functions at crank angles (rad), shape (angles, table_columns), one angle after the other. An extension may
  !> override this procedure by one that is faster for many angles.
  subroutine tabulate_one_by_one(self, angles, table)
    class(mechanism_type), intent(in) :: self
    real(dp), contiguous, intent(in) :: angles(:)
    real(dp), contiguous, intent(out) :: table(:, :)
    type(mass_functions_type) :: a
    integer :: k

    do k = 1, size(angles)
      call self%mass_functions(angles(k), a)
      table(k, a1_v:a1_dd) = [a%a1%v, a%a1%d, a%a1%dd]
      table(k, a2_v:a2_dd) = [a%a2%v, a%a2%d, a%a2%dd]
      table(k, a3_v:a3_dd) = [a%a3%v, a%a3%d, a%a3%dd]
      table(k, a4_v) = a%a4
    end do
  end subroutine tabulate_one_by_one

  !> Default of `tabulate_drive`: the functions H and K of the drive are unknown, and `known` is false. Overriding versions
  !> tabulate them at crank angles (rad), shape (angles, drive_columns). H is the angular momentum and K twice the kinetic energy
  !> of the links at unit crank speed.
  subroutine default_tabulate_drive(self, angles, table, known)
    class(mechanism_type), intent(in) :: self
    real(dp), intent(in) :: angles(:)
    real(dp), intent(out) :: table(:, :)
    logical, intent(out) :: known

    associate (unused_mechanism => self, unused_angles => angles)
    end associate
    table = 0
    known = .false.
  end subroutine default_tabulate_drive

  !> Default of `sum_loads`: there are no loads. Overriding versions sum the loads at crank angles (rad). `origin`: position of the
  !> mechanism's origin relative to the frame's centre of mass (m).
  pure subroutine default_sum_loads(self, angles, origin, sums)
    class(mechanism_type), intent(in) :: self
    real(dp), intent(in) :: angles(:), origin(2)
    type(load_sums_type), intent(out) :: sums(:)

    associate (unused_mechanism => self, unused_angles => angles, unused_origin => origin, unused_sums => sums)
    end associate
  end subroutine default_sum_loads

  !> Default of `prepare`, which does nothing. A frame calls `prepare` once, for its own copy of the mechanism. Overriding versions
  !> fail if the mechanism cannot turn.
  subroutine default_prepare(self, error)
    class(mechanism_type), intent(inout) :: self
    type(error_type), allocatable, intent(out) :: error

    associate (unused_mechanism => self, unused_error => error)
    end associate
  end subroutine default_prepare

  !> Default of `check`, which never fails. Overriding versions fail if the mechanism is not ready to compute its mass functions.
  subroutine default_check(self, error)
    class(mechanism_type), intent(in) :: self
    type(error_type), allocatable, intent(out) :: error

    associate (unused => self)
    end associate
    if (allocated(error)) deallocate(error)
  end subroutine default_check

  !> Default of `link_offset`: -1, because a general mechanism has no links. The version for a linkage returns the distance (m) of a
  !> link's centre of mass from the link's first joint, or a negative number if no link has this name.
  pure real(dp) function default_link_offset(self, name) result(offset)
    class(mechanism_type), intent(in) :: self
    character(len=*), intent(in) :: name

    associate (unused_mechanism => self, unused_name => name)
    end associate
    offset = -1
  end function default_link_offset

  !> Orders k of the harmonics (k cycles per period) that the shafts excite. Their frequencies are multiples of the drive speed or
  !> of a crank's speed, and at most `highest` times the drive speed.
  pure function harmonics(self, highest)
    class(mechanism_type), intent(in) :: self
    integer, intent(in) :: highest
    integer, allocatable :: harmonics(:)
    integer :: k

    harmonics = [(k, k = 1, highest * self%turns)]
    if (allocated(self%crank_turns)) harmonics = pack(harmonics, modulo(harmonics, self%turns) == 0 &
      & .or. [(any(modulo(k, self%crank_turns) == 0), k = 1, size(harmonics))])
  end function harmonics

end module gestell_model_mechanism
