!> Layout of a picture with several scenes: where their views stand, and where their points appear.
module gestell_output_picture_layout
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise
  use gestell_output_picture_scene, only: scene_type, view_type
  implicit none (type, external)
  private

  public :: caption_of, place, projected

  !> Sizes in pixels: width of the picture, maximum height of a scene, space around views and scenes, height of a line of text, and
  !> height of the heading
  real(dp), parameter, public :: wide = 800, tallest = 620, margin = 20, line_height = 18, heading = 54

  !> How a view of a scene is drawn: it shows the coordinates from `low` to `high` (m) from the pixel `corner` on, with `scale`
  !> pixels per metre.
  type, public :: window_type
    type(view_type) :: view
    real(dp) :: low(2) = 0, high(2) = 0, corner(2) = 0, scale = 1
  end type window_type

  !> A scene in the picture.
  type, public :: cell_type
    type(window_type), allocatable :: windows(:)
    !> Positions of all points with the magnified motion (m), shape (3, points, instants)
    real(dp), allocatable :: at(:, :, :)
    !> Left upper corner of the caption (pixels)
    real(dp) :: caption(2) = 0
  end type cell_type

contains

  !> Caption of a scene: its name, and how its motion is magnified.
  pure function caption_of(scene) result(words)
    type(scene_type), intent(in) :: scene
    character(len=:), allocatable :: words

    words = "motion of the frame magnified " // concise(scene%magnification, 6) // " times"
    if (.not. scene%magnification > 1) words = "motion of the frame to scale"
    if (.not. any(abs(scene%motion) > 0)) words = "frame at rest"
    if (allocated(scene%name)) words = scene%name
  end function caption_of

  !> Places the scenes in rows. In each scene the second view stands to the right of the first, and the third below it, all with the
  !> same scale.
  pure subroutine place(scenes, cells, pixels)
    type(scene_type), intent(in) :: scenes(:)
    type(cell_type), intent(out) :: cells(:)
    !> Width and height of the picture
    integer, intent(out) :: pixels(2)
    real(dp) :: low(3), room(3), whole(2), gap, scale, width, top, height
    integer :: columns, i, k

    columns = min(size(scenes), merge(2, 3, size(scenes(1)%views) > 1))
    width = (wide - margin) / columns - margin
    top = heading
    height = heading
    do k = 1, size(scenes)
      associate (scene => scenes(k), cell => cells(k))
        allocate(cell%at(3, size(scene%share), size(scene%degrees)), cell%windows(size(scene%views)))
        do i = 1, size(scene%degrees)
          cell%at(:, :, i) = scene%positions(i, scene%magnification)
        end do
        low = [(minval(cell%at(i, :, :)), i = 1, 3)]
        room = [(maxval(cell%at(i, :, :)), i = 1, 3)] - low
        gap = merge(2 * margin + line_height, 0.0_dp, size(scene%views) > 1)
        whole = room(:2) + merge(room(3), 0.0_dp, size(scene%views) > 1)
        scale = min((width - gap) / max(whole(1), tiny(1.0_dp)), (tallest - gap) / max(whole(2), tiny(1.0_dp)))
        if (modulo(k - 1, columns) == 0) top = height
        cell%caption = [margin + modulo(k - 1, columns) * (width + margin), top + line_height / 2]
        do i = 1, size(scene%views)
          associate (axes => [scene%views(i)%right, scene%views(i)%upward])
            cell%windows(i) = window_type(scene%views(i), low(axes), low(axes) + room(axes), cell%caption + [0.0_dp, line_height], &
              & scale)
          end associate
          if (gap > 0) cell%windows(i)%corner(2) = cell%windows(i)%corner(2) + line_height
          if (i == 2) cell%windows(i)%corner(1) = cell%windows(i)%corner(1) + scale * room(1) + gap
          if (i == 3) cell%windows(i)%corner(2) = cell%windows(i)%corner(2) + scale * room(2) + gap
        end do
        ! a single view stands in the middle
        if (size(scene%views) == 1) cell%windows(1)%corner(1) = cell%windows(1)%corner(1) + (width - scale * whole(1)) / 2
        height = max(height, top + scale * whole(2) + gap + merge(3, 2, gap > 0) * line_height + margin)
      end associate
    end do
    pixels = nint([wide, height])
  end subroutine place

  !> Point of the picture (pixels, downward) at which a point of the scene (m) appears.
  pure function projected(window, point) result(spot)
    type(window_type), intent(in) :: window
    real(dp), intent(in) :: point(3)
    real(dp) :: spot(2)

    associate (view => window%view)
      spot = [point(view%right) - window%low(1), window%high(2) - point(view%upward)]
      if (view%flipped) spot(2) = point(view%upward) - window%low(2)
    end associate
    spot = window%corner + window%scale * spot
  end function projected

end module gestell_output_picture_layout
