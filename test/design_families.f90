!> Families of machines for the tests of designs.
module design_families
  use checks, only: check_success
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp
  use gestell_input_machine_family, only: document_family_type, new_document_family
  use gestell_input_namelist, only: parse_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema, only: schema_type
  use gestell_input_schema_check, only: check_document
  use gestell_study_design_goal, only: new_goal
  use gestell_study_design_perturbed_members, only: condition_type
  use gestell_study_design_perturbed_members, only: mass_part, place_parts
  use gestell_study_design_problem, only: design_options
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_registry, only: input_schema, read_configuration
  use testdrive, only: error_type
  implicit none (type, external)
  private

  public :: new_design, new_family

  character, parameter, public :: newline = new_line("a")
  !> A small machine with all features that a gradient can depend on.
  character(len=*), parameter, public :: machine = &
    & "&drive speed_rpm=900 /" // newline // &
    & "&joint name='O', type='ground', position=0,0 /" // newline // &
    & "&joint name='A', type='crank', pivot='O', radius=0.05 /" // newline // &
    & "&joint name='B', type='RRP', ends='A', lengths=0.2, guide_point=0.0,0.01, guide_angle=80, branch=1 /" // newline // &
    & "&link name='crank', from='O', to='A', mass=2, inertia=0.002, center=0.01,0.002 /" // newline // &
    & "&link name='rod', from='A', to='B', mass=0.6, inertia=0.003, center=0.065,0.0 /" // newline // &
    & "&link name='piston', from='B', mass=0.5, inertia=0 /" // newline // &
    & "&frame mass=25, inertia=0.6, origin=0.02,0.05 /" // newline // &
    & "&support position=-0.20,-0.25, stiffness=6e4,1.2e5, damping=60,120, angle=10 /" // newline // &
    & "&support position= 0.25,-0.25, stiffness=6e4,1.2e5, damping=60,120, angle=5, axes='frame' /" // newline // &
    & "&gravity /" // newline // &
    & "&probe name='p', position=0.1,0.05 /" // newline

  !> The paper's machine with a counterweight on crank and rocker.
  character(len=*), parameter :: four_bar = &
    & "&model frame='rest' / &drive speed_rpm=240 /" // newline // &
    & "&joint name='A0', type='ground', position=0,0 / &joint name='B0', type='ground', position=0.40,0 /" // newline // &
    & "&joint name='A', type='crank', pivot='A0', radius=0.07 /" // newline // &
    & "&joint name='B', type='RRR', ends='A','B0', lengths=0.37,0.16, branch=1 /" // newline // &
    & "&link name='crank', from='A0', to='A', mass=0.50, inertia=0.0035, center=0.03,0 /" // newline // &
    & "&link name='coupler', from='A', to='B', mass=0.60, inertia=0.0070, center=0.18,0 /" // newline // &
    & "&link name='rocker', from='B0', to='B', mass=0.25, inertia=0.0060, center=0.08,0 /" // newline // &
    & "&link name='one', from='A0', to='A', mass=1, inertia=0, center=0,0 /" // newline // &
    & "&link name='two', from='B0', to='B', mass=1, inertia=0, center=0,0 /" // newline // &
    & "&frame mass=18, inertia=0.78, origin=-0.20,0.20 /" // newline // &
    & "&support position=-0.30,-0.20, stiffness=4e5,4e5 /" // newline // &
    & "&support position=0.30,-0.20, stiffness=4e5,4e5, damping=100,100 /" // newline
  character(len=*), parameter, public :: places(4) = [character(len=20) :: "link(one).center(1)", "link(one).center(2)", &
    & "link(two).center(1)", "link(two).center(2)"]

contains

  !> The family of the machine with `paths` as parameters.
  subroutine new_family(text, paths, start, family, options, configuration, error)
    character(len=*), intent(in) :: text, paths(:)
    real(dp), intent(in) :: start(:)
    type(document_family_type), intent(out) :: family
    type(design_options), intent(out) :: options
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(document_type) :: doc
    type(schema_type) :: schema
    type(gestell_error), allocatable :: failure

    schema = input_schema()
    call parse_document(text, "in.nml", doc, failure)
    if (.not. allocated(failure)) call check_document(doc, schema, failure)
    if (.not. allocated(failure)) call read_configuration(doc, configuration, failure)
    if (.not. allocated(failure)) call new_document_family(family, configuration%document, configuration%schema, &
      & configuration%units, paths, failure, start)
    call check_success(error, failure)
    if (allocated(error)) return
    options%probes = configuration%probes
    options%model = configuration%model()
    options%accuracy = configuration%accuracy
    options%accuracy%tolerance = 1.0e-11_dp
    allocate(options%objectives(0), options%constraints(0))
  end subroutine new_family

  !> A design of the four-bar linkage with these parameters within -0.2 to 0.2, masses 0.1 to 2.
  subroutine new_design(paths, quantity, measure, family, options, configuration, error)
    character(len=*), intent(in) :: paths(:), quantity
    integer, intent(in) :: measure
    type(document_family_type), intent(out) :: family
    type(design_options), intent(out) :: options
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(gestell_error), allocatable :: failure
    integer :: k

    call new_family(four_bar, paths, [(1.0_dp, k = 1, size(paths))], family, options, configuration, error)
    if (allocated(error)) return
    options%lower = [(merge(0.1_dp, -0.2_dp, index(paths(k), "mass") > 0), k = 1, size(paths))]
    options%upper = [(merge(2.0_dp, 0.2_dp, index(paths(k), "mass") > 0), k = 1, size(paths))]
    options%body = [(merge(1, 2, index(paths(k), "one") > 0), k = 1, size(paths))]
    options%part = [(merge(mass_part, merge(place_parts(1), place_parts(2), index(paths(k), "(1)") > 0), &
      & index(paths(k), "mass") > 0), k = 1, size(paths))]
    options%conditions = [condition_type()]
    deallocate(options%objectives)
    allocate(options%objectives(1))
    call new_goal(configuration%frame, configuration%probes, quantity, measure, options%objectives(1), failure)
    call check_success(error, failure)
  end subroutine new_design

end module design_families
