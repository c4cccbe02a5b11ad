!> From the groups of an input file to the machine and the orders that they describe.
module gestell_io_configuration
  use gestell_base_error, only: error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_base_text, only: short, text
  use gestell_floquet_methods, only: method_names
  use gestell_floquet_monodromy, only: accuracy_type
  use gestell_io_document, only: document_type, group_type, groups_named, the_group, word_length
  use gestell_io_get, only: at_least, get, nonnegative, nonzero, positive
  use gestell_io_mechanism, only: in_group, name_line, read_linkage
  use gestell_io_message, only: input_error
  use gestell_model_frame, only: frame_type, freedom_names, new_frame
  use gestell_model_linkage, only: linkage_type
  use gestell_model_mounting, only: damping_matrix, stiffness_matrix, support_type
  use gestell_study_analysis, only: tasks_type
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  implicit none (type, external)
  private

  public :: read_configuration

  !> Everything that an input file says.
  type, public :: configuration_type
    character(len=:), allocatable :: title
    type(tasks_type) :: tasks
    type(accuracy_type) :: accuracy
    type(linkage_type) :: linkage
    type(frame_type) :: frame
  end type configuration_type

  character(len=*), parameter :: task_names(*) = [character(len=9) :: "stability", "modes", "response"]

contains

  !> The configuration of a checked document; the mechanism has been turned once.
  !> Errors: values out of range, joints that do not fit together (code 2), a mechanism that cannot turn (3).
  subroutine read_configuration(doc, configuration, error)
    type(document_type), intent(in) :: doc
    type(configuration_type), intent(out) :: configuration
    type(error_type), allocatable, intent(out) :: error

    call read_orders(doc, configuration, error)
    if (allocated(error)) return
    call read_linkage(doc, configuration%linkage, error)
    if (allocated(error)) return
    call read_frame(doc, configuration%linkage, configuration%frame, error)
  end subroutine read_configuration

  !> Title, tasks and accuracy.
  subroutine read_orders(doc, configuration, error)
    type(document_type), intent(in) :: doc
    type(configuration_type), intent(inout) :: configuration
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    character(len=word_length), allocatable :: tasks(:)

    group = the_group(doc, "case")
    call get(group, "title", configuration%title, error, default="")
    if (allocated(error)) return
    call get(group, "tasks", tasks, error, default=[character(len=9) :: "stability", "response"], allowed=task_names)
    if (allocated(error)) return
    configuration%tasks%stability = any(tasks == "stability")
    configuration%tasks%modes = any(tasks == "modes")
    configuration%tasks%response = any(tasks == "response")

    group = the_group(doc, "response")
    call get(group, "points", configuration%tasks%points, error, default=360, must=at_least(1))
    if (allocated(error)) return
    call get(group, "harmonics", configuration%tasks%harmonics, error, default=20, must=at_least(0))
    if (allocated(error)) return
    call at_most(group, "points", configuration%tasks%points, 1000000, error)
    if (allocated(error)) return
    call at_most(group, "harmonics", configuration%tasks%harmonics, 8000, error)
    if (allocated(error)) return

    group = the_group(doc, "accuracy")
    associate (accuracy => configuration%accuracy)
      call get(group, "tolerance", accuracy%tolerance, error, default=1.0e-9_dp, must=positive)
      if (allocated(error)) return
      if (accuracy%tolerance < 1.0e-15_dp .or. accuracy%tolerance > 0.1_dp) then
        call input_error(group, "tolerance", "must lie between 1e-15 and 0.1", error)
        return
      end if
      call get(group, "method", accuracy%method, error, default="auto", allowed=method_names())
      if (allocated(error)) return
      call get(group, "steps", accuracy%steps, error, default=0, must=at_least(0))
      if (allocated(error)) return
      call at_most(group, "steps", accuracy%steps, 4194304, error)
    end associate
  end subroutine read_orders

  subroutine at_most(group, key, value, limit, error)
    type(group_type), intent(in) :: group
    character(len=*), intent(in) :: key
    integer, intent(in) :: value, limit
    type(error_type), allocatable, intent(out) :: error

    if (value > limit) call input_error(group, key, "must be at most " // text(limit), error)
  end subroutine at_most

  !> Frame, supports, foundation and drive.
  subroutine read_frame(doc, linkage, frame, error)
    type(document_type), intent(in) :: doc
    type(linkage_type), intent(in) :: linkage
    type(frame_type), intent(out) :: frame
    type(error_type), allocatable, intent(out) :: error
    type(group_type) :: group
    type(support_type), allocatable :: supports(:)
    real(dp) :: mass, inertia, origin(2), stiffness(3, 3), damping(3), speed_rpm, b(3, 3)
    integer, allocatable :: free(:)
    integer :: i, k

    group = the_group(doc, "drive")
    call get(group, "speed_rpm", speed_rpm, error, must=nonzero)
    if (allocated(error)) return
    if (abs(speed_rpm) < 1.0e-300_dp) then
      call input_error(group, "speed_rpm", "is too small", error)
      return
    end if

    call read_supports(groups_named(doc, "support"), supports, error)
    if (allocated(error)) return
    group = the_group(doc, "foundation")
    call get(group, "stiffness", stiffness, error, default=0.0_dp)
    if (allocated(error)) return
    do i = 1, 3
      k = 1 + mod(i, 3)
      if (.not. abs(stiffness(i, k) - stiffness(k, i)) > 0) cycle
      call input_error(group, "stiffness", "the matrix must be symmetric, c" // text(i) // text(k) // " is " &
        & // short(stiffness(i, k)) // " and c" // text(k) // text(i) // " is " // short(stiffness(k, i)), error, &
        & element=i + 3 * (k - 1))
      return
    end do
    call get(group, "damping", damping, error, default=0.0_dp, must=nonnegative)
    if (allocated(error)) return
    b = damping_matrix(supports)
    do i = 1, 3
      b(i, i) = b(i, i) + damping(i)
    end do

    group = the_group(doc, "frame")
    call get(group, "mass", mass, error, must=positive)
    if (allocated(error)) return
    call get(group, "inertia", inertia, error, must=positive)
    if (allocated(error)) return
    call get(group, "origin", origin, error)
    if (allocated(error)) return
    call read_freedoms(group, free, error)
    if (allocated(error)) return
    call new_frame(frame, linkage, mass, inertia, origin, stiffness + stiffness_matrix(supports), b, &
      & speed_rpm * 2 * pi / 60, error, free)
    if (.not. allocated(error)) return
    if (allocated(error%subject)) then
      call name_line(doc, error)
    else
      call in_group(group, error)
    end if
  end subroutine read_frame

  subroutine read_supports(groups, supports, error)
    type(group_type), intent(in) :: groups(:)
    type(support_type), allocatable, intent(out) :: supports(:)
    type(error_type), allocatable, intent(out) :: error
    integer :: i

    allocate(supports(size(groups)))
    do i = 1, size(groups)
      associate (support => supports(i), group => groups(i))
        call get(group, "position", support%position, error)
        if (allocated(error)) return
        call get(group, "stiffness", support%stiffness, error, must=nonnegative)
        if (allocated(error)) return
        call get(group, "damping", support%damping, error, default=0.0_dp, must=nonnegative)
        if (allocated(error)) return
        call get(group, "angle", support%angle, error, default=0.0_dp)
        if (allocated(error)) return
        support%angle = support%angle * pi / 180
        if (all(ieee_is_finite(stiffness_matrix([support])) .and. ieee_is_finite(damping_matrix([support])))) cycle
        call input_error(group, "position", "so far from F its stiffness or damping about F overflows", error)
        return
      end associate
    end do
  end subroutine read_supports

  !> Key `dof`: places of the free degrees of freedom, each once, in the order of the matrices.
  subroutine read_freedoms(group, free, error)
    type(group_type), intent(in) :: group
    integer, allocatable, intent(out) :: free(:)
    type(error_type), allocatable, intent(out) :: error
    character(len=word_length), allocatable :: names(:)
    integer :: i

    call get(group, "dof", names, error, default=freedom_names, allowed=freedom_names)
    if (allocated(error)) return
    free = pack([1, 2, 3], [(any(names == freedom_names(i)), i = 1, 3)])
    if (size(free) /= size(names)) call input_error(group, "dof", "names a degree of freedom twice", error)
  end subroutine read_freedoms

end module gestell_io_configuration
