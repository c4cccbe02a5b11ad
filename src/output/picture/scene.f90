!> A scene: a machine whose frame and mechanism move. Pictures, animations and the HTML page draw the same scene.
module gestell_output_picture_scene
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, text
  use gestell_math_rotation, only: rotation_matrix
  implicit none (type, external)
  private

  public :: new_scene

  !> Kinds of lines. `outline`: filled polygon of the frame. `pin`, `center`, `probe`: single points that are drawn as symbols. The
  !> lines of all other kinds connect their points.
  character(len=*), parameter, public :: outline = "frame", ground = "ground", spring = "spring", guide = "guide", bar = "bar", &
    & block = "slider", pin = "pin", center = "centre", probe = "probe"

  !> A line through points of a scene.
  type, public :: line_type
    character(len=8) :: kind = ""
    !> Colour as six hexadecimal digits; blank if the kind of line determines it
    character(len=6) :: colour = ""
    !> Indices of its points
    integer, allocatable :: points(:)
    !> The only view in which the line appears; 0 if it appears in all views
    integer :: view = 0
  end type line_type

  !> A view of a scene: the axes that point to the right and upward. `flipped`: true if the second axis points downward.
  type, public :: view_type
    character(len=16) :: name = ""
    integer :: right = 1, upward = 2
    logical :: flipped = .false.
  end type view_type

  !> A scene in which the frame moves on its mounts and the mechanism moves in the frame. The origin is F with the frame at rest.
  type, public :: scene_type
    !> Caption of the scene, if it does not follow from the magnification
    character(len=:), allocatable :: name
    type(view_type), allocatable :: views(:)
    type(line_type), allocatable :: lines(:)
    !> Points with the frame at rest (m), shape (3, points), and the share of the frame's motion that they follow: 1 on the frame, 0
    !> on the ground, between these on springs. `carrier`: index of the moving point that replaces the point; 0 for constant points
    real(dp), allocatable :: points(:, :), share(:)
    integer, allocatable :: carrier(:)
    !> Positions of the moving points relative to the frame (m), shape (3, moving points, instants)
    real(dp), allocatable :: moving(:, :, :)
    !> Displacement (m) and rotation vector (rad) of the frame, shape (6, instants)
    real(dp), allocatable :: motion(:, :)
    !> Crank angle at each instant (degrees)
    real(dp), allocatable :: degrees(:)
    !> `magnification`: factor by which the motion of the frame is magnified. `seconds`: how long an animation shows a period.
    !> `extent`: size of the machine (m)
    real(dp) :: magnification = 1, seconds = 4, extent = 1
  contains
    procedure :: add_line, add_moving, positions, json, scale_motion
  end type scene_type

contains

  !> A scene without lines, seen in these `views`. `moving`: positions of the moving points relative to the frame (m), shape (3,
  !> moving points, instants). `motion`: displacement and rotation vector of the frame, shape (6, instants). `degrees`: crank
  !> angles.
  pure type(scene_type) function new_scene(views, moving, motion, degrees) result(scene)
    type(view_type), intent(in) :: views(:)
    real(dp), intent(in) :: moving(:, :, :), motion(:, :), degrees(:)

    scene%views = views
    scene%moving = moving
    scene%motion = motion
    scene%degrees = degrees
    allocate(scene%lines(0), scene%points(3, 0), scene%share(0), scene%carrier(0))
  end function new_scene

  !> Adds a line through constant points (m), shape (2 or 3, points). Each point follows the frame's motion with its `share`.
  pure subroutine add_line(self, kind, points, share, colour)
    class(scene_type), intent(inout) :: self
    character(len=*), intent(in) :: kind
    real(dp), intent(in) :: points(:, :), share(:)
    character(len=*), intent(in), optional :: colour
    real(dp) :: in_space(3, size(points, 2))
    integer :: i, n

    n = size(self%share)
    in_space = 0
    in_space(:size(points, 1), :) = points
    self%points = reshape([self%points, in_space], [3, n + size(share)])
    self%share = [self%share, share]
    self%carrier = [self%carrier, (0, i = 1, size(share))]
    call append(self, kind, [(i, i = n + 1, n + size(share))], colour)
  end subroutine add_line

  !> Adds a line through the moving points with these `numbers`.
  pure subroutine add_moving(self, kind, numbers, colour)
    class(scene_type), intent(inout) :: self
    character(len=*), intent(in) :: kind
    integer, intent(in) :: numbers(:)
    character(len=*), intent(in), optional :: colour
    integer :: i, n

    n = size(self%share)
    self%points = reshape([self%points, self%moving(:, numbers, 1)], [3, n + size(numbers)])
    self%share = [self%share, (1.0_dp, i = 1, size(numbers))]
    self%carrier = [self%carrier, numbers]
    call append(self, kind, [(i, i = n + 1, n + size(numbers))], colour)
  end subroutine add_moving

  pure subroutine append(scene, kind, points, colour)
    type(scene_type), intent(inout) :: scene
    character(len=*), intent(in) :: kind
    integer, intent(in) :: points(:)
    character(len=*), intent(in), optional :: colour
    type(line_type) :: line

    line%kind = kind
    line%points = points
    if (present(colour)) line%colour = colour
    scene%lines = [scene%lines, line]
  end subroutine append

  !> Positions of all points at an instant (m), shape (3, points), with the frame's motion magnified. A point p of the frame moves
  !> to M u + R(M theta) p, where M is the magnification, u the displacement, and R the rotation matrix of the rotation vector
  !> theta.
  pure function positions(self, instant, magnification) result(at)
    class(scene_type), intent(in) :: self
    integer, intent(in) :: instant
    real(dp), intent(in) :: magnification
    real(dp) :: at(3, size(self%share)), rotation(3, 3)
    integer :: i

    rotation = rotation_matrix(magnification * self%motion(4:, instant))
    do i = 1, size(self%share)
      at(:, i) = self%points(:, i)
      if (self%carrier(i) > 0) at(:, i) = self%moving(:, self%carrier(i), instant)
      at(:, i) = at(:, i) + self%share(i) * (magnification * self%motion(:3, instant) + matmul(rotation, at(:, i)) - at(:, i))
    end do
  end function positions

  !> Makes the largest displacement of a point of the frame equal to `part` of the machine's size. If `rounded`, by the largest
  !> magnification of the form 1, 2 or 5 times a power of ten, at least 1, that does not exceed this; otherwise by changing the
  !> motion.
  pure subroutine scale_motion(self, part, rounded)
    class(scene_type), intent(inout) :: self
    real(dp), intent(in) :: part
    logical, intent(in) :: rounded
    real(dp), parameter :: round(4) = [1.0_dp, 2.0_dp, 5.0_dp, 10.0_dp]
    real(dp) :: largest, power
    integer :: k

    largest = 0
    do k = 1, size(self%degrees)
      largest = max(largest, maxval(norm2(self%positions(k, 1.0_dp) - self%positions(k, 0.0_dp), dim=1)))
    end do
    if (.not. largest > self%extent * 1.0e-12_dp) return
    associate (factor => part * self%extent / largest)
      if (rounded) then
        if (factor < 1) return
        power = 10.0_dp**floor(log10(factor))
        self%magnification = power * maxval(round, mask=round * power <= factor)
      else
        self%motion = factor * self%motion
      end if
    end associate
  end subroutine scale_motion

  !> The scene as JSON text, for the page. Indices of points, moving points, views and axes count from 0; -1 marks a constant
  !> point, and a line that appears in all views. The last instant, which repeats the first, is omitted. If the moving points do not
  !> move, they have a single instant.
  pure function json(self) result(words)
    class(scene_type), intent(in) :: self
    character(len=:), allocatable :: words
    type(growing_text_type) :: all
    integer :: i, k, instants, positions

    instants = size(self%degrees) - 1
    positions = 1
    if (maxval(maxval(self%moving, dim=3) - minval(self%moving, dim=3)) > 0) positions = instants
    call all%append('{"name":"')
    if (allocated(self%name)) call all%append(self%name)
    call all%append('","views":[')
    do i = 1, size(self%views)
      associate (view => self%views(i))
        call all%append(comma(i) // '{"name":"' // trim(view%name) // '","right":' // text(view%right - 1) // ',"up":' &
          & // text(view%upward - 1) // ',"flip":' // trim(merge("true ", "false", view%flipped)) // "}")
      end associate
    end do
    call all%append('],"points":[')
    do i = 1, size(self%share)
      call all%append(comma(i) // list([self%points(:, i), self%share(i), real(self%carrier(i) - 1, dp)]))
    end do
    call all%append('],"lines":[')
    do i = 1, size(self%lines)
      associate (line => self%lines(i))
        call all%append(comma(i) // '{"kind":"' // trim(line%kind) // '","colour":"')
        if (line%colour /= "") call all%append("#" // line%colour)
        call all%append('","view":' // text(line%view - 1) // ',"points":' // list(real(line%points - 1, dp)) // "}")
      end associate
    end do
    call all%append('],"moving":[')
    do k = 1, positions
      call all%append(comma(k) // "[")
      do i = 1, size(self%moving, 2)
        call all%append(comma(i) // list(self%moving(:, i, k)))
      end do
      call all%append("]")
    end do
    call all%append('],"motion":[')
    do k = 1, instants
      call all%append(comma(k) // list(self%motion(:, k)))
    end do
    call all%append('],"degrees":' // list(self%degrees(:instants)) // ',"magnification":' // concise(self%magnification, 6) &
      & // ',"seconds":' // concise(self%seconds, 6) // "}")
    words = all%whole()
  end function json

  !> A comma before every element of a JSON list except the first.
  pure function comma(number) result(word)
    integer, intent(in) :: number
    character(len=:), allocatable :: word

    word = ","
    if (number == 1) word = ""
  end function comma

  !> A JSON list of numbers with six significant digits.
  pure function list(numbers) result(words)
    real(dp), intent(in) :: numbers(:)
    character(len=:), allocatable :: words
    integer :: i

    words = "["
    do i = 1, size(numbers)
      words = words // comma(i) // concise(numbers(i), 6)
    end do
    words = words // "]"
  end function list

end module gestell_output_picture_scene
