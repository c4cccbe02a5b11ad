!> Scenes of moving machines: positions by an independent model, rigid bodies, the ground at rest, and the shapes of modes.
module test_animation
  use checks, only: check_success, check_that
  use gestell_base_error, only: gestell_error => error_type
  use gestell_base_kinds, only: dp, pi
  use gestell_input_namelist, only: parse_document, read_document
  use gestell_input_namelist_document, only: document_type
  use gestell_input_schema_check, only: check_document
  use gestell_output_picture_scene, only: bar, ground, outline, pin, scene_type, spring
  use gestell_study_mode, only: mode_type
  use gestell_study_vibration_analysis, only: analyse, analysis_type
  use gestell_task_common_configuration, only: configuration_type
  use gestell_task_drawing, only: build_motion
  use gestell_task_modes_shapes, only: build_shapes
  use gestell_task_registry, only: input_schema, read_configuration
  use testdrive, only: error_type, new_unittest, unittest_type
  implicit none (type, external)
  private

  public :: collect_animation

contains

  subroutine collect_animation(testsuite)
    type(unittest_type), allocatable, intent(out) :: testsuite(:)

    testsuite = [ &
      & new_unittest("the crank pin of the compressor is where an independent model has it", test_crank_pin), &
      & new_unittest("frame and links keep their lengths, and the ground is at rest, at any magnification", test_rigid), &
      & new_unittest("a crank that turns uniformly in space does so on a frame that rotates", test_uniform), &
      & new_unittest("a mode shape moves the frame as its two degrees of freedom say", test_shape)]
  end subroutine collect_animation

  !> The scene of an input with its vibration: of a file, or of this `text`.
  subroutine scene_of(path, scene, configuration, failure, text)
    character(len=*), intent(in) :: path
    type(scene_type), intent(out) :: scene
    type(configuration_type), intent(out) :: configuration
    type(gestell_error), allocatable, intent(out) :: failure
    character(len=*), intent(in), optional :: text
    type(document_type) :: document
    type(analysis_type) :: analysis

    if (present(text)) then
      call parse_document(text, path, document, failure)
    else
      call read_document(path, document, failure)
    end if
    if (.not. allocated(failure)) call check_document(document, input_schema(), failure)
    if (.not. allocated(failure)) call read_configuration(document, configuration, failure)
    if (allocated(failure)) return
    configuration%analysis%response = .true.
    call analyse(configuration%frame, configuration%analysis, configuration%accuracy, analysis, failure)
    if (.not. allocated(failure)) call build_motion(analysis, configuration%frame%mechanism, configuration%probes, scene)
  end subroutine scene_of

  !> data/compressor.nml on the exact frame at 1450 rpm, crank at 45 deg: displacement of the frame and crank pin in space, by an
  !> independent model (2 x 10 digits).
  subroutine test_crank_pin(error)
    type(error_type), allocatable, intent(out) :: error
    type(scene_type) :: scene
    type(configuration_type) :: configuration
    type(gestell_error), allocatable :: failure
    !> The numbers have ten digits; the vibration is as accurate as the default tolerance
    real(dp), parameter :: tolerance = 2.0e-9_dp
    real(dp), parameter :: frame(3) = [-6.186954037e-4_dp, -1.464630872e-3_dp, 9.428308591e-4_dp]
    real(dp), parameter :: crank_pin(2) = [-8.84767452173e-4_dp, 0.280740779607_dp]
    real(dp), allocatable :: at(:, :)
    integer :: instant, i

    call scene_of("data/compressor.nml", scene, configuration, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    instant = minloc(abs(abs(scene%degrees) - 45), dim=1)
    call check_that(error, abs(scene%degrees(instant)), "==", 45.0_dp, "crank angle")
    if (.not. allocated(error)) call check_that(error, maxval(abs(scene%motion([1, 2, 6], instant) - frame)), "<", tolerance, &
      & "motion of the frame")
    if (allocated(error)) return
    at = scene%positions(instant, 1.0_dp)
    ! the pin that comes closest to the one expected
    call check_that(error, minval([(norm2(at(:2, scene%lines(i)%points(1)) - crank_pin), i = 1, size(scene%lines))], &
      & mask=scene%lines%kind == pin), "<", tolerance, "crank pin")
  end subroutine test_crank_pin

  !> In the plane and in space, to scale and magnified 50 times: distances between the points of the frame's outline, lengths of
  !> bars that are no sliders, and points of the ground.
  subroutine test_rigid(error)
    type(error_type), allocatable, intent(out) :: error
    type(scene_type) :: scene
    type(configuration_type) :: configuration
    type(gestell_error), allocatable :: failure
    character(len=*), parameter :: files(2) = [character(len=24) :: "data/khang_four_bar.nml", "data/v_twin.nml"]
    real(dp), parameter :: magnifications(2) = [1.0_dp, 50.0_dp]
    ! sums of some ten rounding errors of numbers up to 1
    real(dp), parameter :: tolerance = 1.0e-13_dp
    real(dp), allocatable :: at(:, :), before(:, :)
    integer :: f, m, k, i, n

    do f = 1, size(files)
      call scene_of(trim(files(f)), scene, configuration, failure)
      call check_success(error, failure)
      if (allocated(error)) return
      do m = 1, size(magnifications)
        before = scene%positions(1, magnifications(m))
        do k = 2, size(scene%degrees), 7
          at = scene%positions(k, magnifications(m))
          do i = 1, size(scene%lines)
            associate (line => scene%lines(i), first => scene%lines(i)%points(1))
              n = size(line%points)
              associate (second => line%points(min(2, n)), last => line%points(n))
                select case (trim(line%kind))
                case (outline, bar)
                  call check_that(error, abs(norm2(at(:, first) - at(:, second)) - norm2(before(:, first) - before(:, second))), &
                    & "<", tolerance, trim(files(f)) // ": length of " // trim(line%kind))
                case (ground)
                  call check_that(error, maxval(abs(at(:, line%points) - before(:, line%points))), "==", 0.0_dp, "ground")
                case (spring)
                  call check_that(error, norm2(at(:, last) - scene%points(:, last)) * (1 - scene%share(last)), "<=", &
                    & norm2(at(:, first) - scene%points(:, first)) + tolerance, "end of a spring")
                case default
                end select
              end associate
              if (allocated(error)) return
            end associate
          end do
        end do
      end do
    end do
  end subroutine test_rigid

  !> A disc that an outside shaft turns uniformly, on a frame that rotates by some degrees: the direction from the pivot to the pin.
  subroutine test_uniform(error)
    type(error_type), allocatable, intent(out) :: error
    type(scene_type) :: scene
    type(configuration_type) :: configuration
    type(gestell_error), allocatable :: failure
    character(len=*), parameter :: machine = "&drive speed_rpm=120, held_by='outside' /" // new_line("a") &
      & // "&joint name='O', type='ground', position=0,0 /" // new_line("a") &
      & // "&joint name='A', type='crank', pivot='O', radius=0.1 /" // new_line("a") &
      & // "&link name='disc', from='O', to='A', mass=2, inertia=0.01, center=0.05,0.02 /" // new_line("a") &
      & // "&frame mass=9, inertia=0.3, origin=0.1,0.2 /" // new_line("a") &
      & // "&support position=-0.2,-0.2, stiffness=1e4,2e4, damping=40,40 /" // new_line("a") &
      & // "&support position=0.3,-0.2, stiffness=1e4,2e4, damping=40,40 /" // new_line("a")
    real(dp), allocatable :: at(:, :)
    integer, allocatable :: pins(:)
    real(dp) :: largest, turn
    integer :: i, k

    call scene_of("text", scene, configuration, failure, text=machine)
    call check_success(error, failure)
    if (allocated(error)) return
    pins = pack([(scene%lines(i)%points(1), i = 1, size(scene%lines))], scene%lines%kind == pin)
    largest = maxval(abs(scene%motion(6, :)))
    call check_that(error, largest, ">", 1.0e-3_dp, "rotation of the frame")
    do k = 1, size(scene%degrees)
      if (allocated(error)) return
      at = scene%positions(k, 1.0_dp)
      turn = scene%degrees(k) * pi / 180
      ! the frame's rotation, as accurate as the default tolerance, turns the pivot and the crank back
      call check_that(error, norm2(at(:2, pins(2)) - at(:2, pins(1)) - 0.1_dp * [cos(turn), sin(turn)]), "<", 1.0e-14_dp, &
        & "direction of the crank")
    end do
  end subroutine test_uniform

  !> A mode with the shape (1, 0, 2i): the frame moves along xi with the cosine, and rotates with minus twice the sine.
  subroutine test_shape(error)
    type(error_type), allocatable, intent(out) :: error
    type(scene_type) :: machine
    type(scene_type), allocatable :: scenes(:)
    type(configuration_type) :: configuration
    type(gestell_error), allocatable :: failure
    type(mode_type) :: mode
    real(dp) :: turn, ratio
    integer :: k, n

    call scene_of("data/khang_four_bar.nml", machine, configuration, failure)
    call check_success(error, failure)
    if (allocated(error)) return
    mode%identified = .true.
    mode%components = 1
    mode%frequencies(1) = 20 * pi
    mode%growth = -pi / 10
    mode%shapes(:3, 1) = [(1.0_dp, 0.0_dp), (0.0_dp, 0.0_dp), (0.0_dp, 2.0_dp)]
    call build_shapes(configuration%frame, [mode], configuration%probes, scenes)
    call check_that(error, scenes(1)%name, "==", "mode 1: 10 Hz, damping 0.5 %")
    if (allocated(error)) return
    n = size(scenes(1)%degrees) - 1
    ! the rotation is the larger component: it has its maximum at the first instant, and xi follows by a quarter of a period
    do k = 0, n
      turn = 2 * pi * k / n
      associate (motion => scenes(1)%motion(:, k + 1), size_of => scenes(1)%motion(6, 1))
        ratio = maxval(abs(motion - size_of * [0.5_dp * sin(turn), 0.0_dp, 0.0_dp, 0.0_dp, 0.0_dp, cos(turn)])) / size_of
        call check_that(error, ratio, "<", 1.0e-14_dp, "motion of the frame")
        if (allocated(error)) return
      end associate
    end do
  end subroutine test_shape

end module test_animation
