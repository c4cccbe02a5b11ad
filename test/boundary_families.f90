!> Families of systems with known stability borders, and machines of data/, for the tests of border searches.
module boundary_families
  use gestell_base_error, only: error_type, failed_computation, fatal_error, impossible_mechanism
  use gestell_base_kinds, only: dp, pi
  use gestell_input_schema_check, only: check_document
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use gestell_input_namelist_document, only: document_type
  use gestell_input_namelist, only: read_document
  use gestell_input_schema_path, only: set_path_real, set_value
  use gestell_system_family, only: family_type
  use gestell_system_periodic, only: periodic_system
  use systems, only: constant_type, mathieu_type
  implicit none (type, external)
  private

  public :: new_machine_family

  !> y'' + d y' + (a - 2 q cos 2 t) y = 0; parameters a, or q with `over_q`, or a and q.
  type, extends(family_type), public :: mathieu_family
    real(dp) :: a = 0, q = 0, d = 0
    logical :: over_q = .false.
  contains
    procedure :: member => mathieu_member
  end type mathieu_family

  !> x' = height(p) x with the period 1: rho = exp(height), real, one state. The kinds:
  !> of one parameter 'gap' (p - 1) (p - 3), impossible for 1.5 < p < 2.5; 'lost' p - 2, cannot be solved for |p - 2| < 0.3; of two
  !> 'circle' |p|**2 - 1; 'circles' two of them, of radius 1 about -+1.5 on the first axis; 'saddle' p1 p2 - offset;
  !> 'stripes' cos(2 pi (p1 + p2 / 4)) - 0.3; 'hole' |p|**2 - 1, impossible for |p - (1, 0)| < 0.4; 'corner' p1, beside a pair
  !> exp(p2 +- 2i) of two more states.
  type, extends(family_type), public :: height_family
    character(len=8) :: kind = "circle"
    real(dp) :: offset = 0
  contains
    procedure :: member => height_member
  end type height_family

  !> q'' + 2 d q' + K q = 0 with K = [5 - 1, p; -p, 5 + 1] and the period 1.3: the circulatory p lets two modes meet. With
  !> lambda**2 + 2 d lambda + 5 +- sqrt(1 - p**2) = 0 flutter begins at p = sqrt(1 + 20 d**2), lambda = i sqrt(5) there.
  type, extends(family_type), public :: flutter_family
    real(dp) :: d = 0
  contains
    procedure :: member => flutter_member
  end type flutter_family

  type, extends(periodic_system) :: height_type
    real(dp) :: height = 0
    complex(dp) :: pair = 0
  contains
    procedure :: matrix => height_matrix
  end type height_type

  !> A machine of an input file, over one or two of its paths.
  type, extends(family_type), public :: machine_family
    type(document_type) :: doc
    character(len=40) :: paths(2) = ""
  contains
    procedure :: member => machine_member
  end type machine_family

contains

  subroutine mathieu_member(self, parameters, system, error)
    class(mathieu_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(mathieu_type) :: own

    own%states = 2
    own%period = pi
    own%a = self%a
    own%q = self%q
    own%d = self%d
    if (.not. self%over_q) own%a = parameters(1)
    if (self%over_q) own%q = parameters(1)
    if (size(parameters) == 2) own%q = parameters(2)
    allocate(system, source=own)
    if (allocated(error)) deallocate(error)
  end subroutine mathieu_member

  subroutine height_member(self, parameters, system, error)
    class(height_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(height_type) :: own
    logical :: impossible

    own%states = 1
    own%period = 1
    associate (p => parameters)
      select case (self%kind)
      case ("circle", "hole")
        own%height = sum(p**2) - 1
      case ("circles")
        own%height = min((p(1) - 1.5_dp)**2, (p(1) + 1.5_dp)**2) + p(2)**2 - 1
      case ("corner")
        own%states = 3
        own%height = p(1)
        own%pair = cmplx(p(2), 2, dp)
      case ("stripes")
        own%height = cos(2 * pi * (p(1) + p(2) / 4)) - 0.3_dp
      case ("gap")
        own%height = (p(1) - 1) * (p(1) - 3)
      case ("lost")
        own%height = p(1) - 2
      case default
        own%height = p(1) * p(2) - self%offset
      end select
    end associate
    if (self%kind == "lost" .and. abs(parameters(1) - 2) < 0.3_dp) then
      call fatal_error(error, "this one cannot be solved", failed_computation)
      return
    end if
    impossible = .false.
    if (self%kind == "hole") impossible = norm2(parameters - [1.0_dp, 0.0_dp]) < 0.4_dp
    if (self%kind == "gap") impossible = abs(parameters(1) - 2) < 0.5_dp
    if (impossible) then
      allocate(error)
      error%message = "a hole"
      error%code = impossible_mechanism
      return
    end if
    allocate(system, source=own)
  end subroutine height_member

  subroutine flutter_member(self, parameters, system, error)
    class(flutter_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(constant_type) :: own

    own%states = 4
    own%period = 1.3_dp
    own%m = reshape([1, 0, 0, 1], [2, 2])
    own%b = 2 * self%d * own%m
    own%c = reshape([4.0_dp, -parameters(1), parameters(1), 6.0_dp], [2, 2])
    allocate(system, source=own)
    if (allocated(error)) deallocate(error)
  end subroutine flutter_member

  subroutine height_matrix(self, t, p)
    class(height_type), intent(in) :: self
    real(dp), intent(in) :: t
    real(dp), intent(out) :: p(:, :)

    associate (unused => t)
    end associate
    p = 0
    p(1, 1) = self%height
    if (self%states < 3) return
    p(2:, 2:) = reshape([real(self%pair), aimag(self%pair), -aimag(self%pair), real(self%pair)], [2, 2])
  end subroutine height_matrix

  !> The family of the machine in `file` over `paths`, with other `settings` if there are any.
  subroutine new_machine_family(file, paths, family, error, settings)
    character(len=*), intent(in) :: file, paths(:)
    type(machine_family), intent(out) :: family
    type(error_type), allocatable, intent(out) :: error
    character(len=*), intent(in), optional :: settings(:)
    integer :: k

    call read_document(file, family%doc, error)
    if (present(settings)) then
      do k = 1, size(settings)
        if (.not. allocated(error)) call set_value(family%doc, input_schema(), trim(settings(k)), error)
      end do
    end if
    if (.not. allocated(error)) call check_document(family%doc, input_schema(), error)
    family%paths(:size(paths)) = paths
  end subroutine new_machine_family

  subroutine machine_member(self, parameters, system, error)
    class(machine_family), intent(in) :: self
    real(dp), intent(in) :: parameters(:)
    class(periodic_system), allocatable, intent(out) :: system
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(configuration_type) :: configuration
    integer :: k

    doc = self%doc
    do k = 1, size(parameters)
      call set_path_real(doc, input_schema(), trim(self%paths(k)), parameters(k), error)
      if (allocated(error)) return
    end do
    call read_configuration(doc, configuration, error)
    if (.not. allocated(error)) allocate(system, source=configuration%frame)
  end subroutine machine_member

end module boundary_families
