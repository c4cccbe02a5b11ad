!> Draws scenes as an animated SVG picture, which any browser plays.
module gestell_output_picture_animation
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, either, newline, text
  use gestell_base_markup, only: escaped
  use gestell_output_picture_layout, only: caption_of, cell_type, line_height, margin, place, projected, window_type
  use gestell_output_picture_scene, only: center, outline, pin, probe, scene_type
  implicit none (type, external)
  private

  public :: animated_svg

  !> Coordinates are whole numbers: tenths of a pixel
  integer, parameter :: fine = 10
  !> Colours follow the page: dark lines on a light page and light lines on a dark one
  character(len=*), parameter :: style = "<style>:root{color-scheme:light dark;--ink:#222;--pale:#8c9bab;--body:#e9edf0}" &
    & // "@media(prefers-color-scheme:dark){:root{--ink:#ddd;--pale:#8090a0;--body:#33393f}}" &
    & // "polyline,polygon{fill:none;stroke:var(--ink);stroke-width:10;stroke-linejoin:round;stroke-linecap:round}" &
    & // ".frame{fill:var(--body);stroke:var(--pale)}.ground{stroke:var(--pale)}" &
    & // ".guide{stroke:var(--pale);stroke-width:70;stroke-opacity:.4}.bar{stroke-width:50}.slider{stroke-width:110}" &
    & // ".pin{fill:var(--body);stroke:var(--ink);stroke-width:14}.centre{fill:none;stroke-width:14}" &
    & // ".probe{fill:none;stroke:#d00;stroke-width:20}text{fill:var(--ink);font:130px sans-serif}</style>"

contains

  !> The scenes as an animated SVG picture.
  function animated_svg(scenes, title, shown) result(svg)
    type(scene_type), intent(in) :: scenes(:)
    !> `title`: title of the input. `shown`: what the picture shows
    character(len=*), intent(in) :: title, shown
    character(len=:), allocatable :: svg
    type(growing_text_type) :: all
    type(cell_type) :: cells(size(scenes))
    integer :: i, k, view, pixels(2)

    call place(scenes, cells, pixels)
    call all%append('<?xml version="1.0" encoding="UTF-8"?>' // newline // '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ' &
      & // coordinates(real(pixels, dp), " ") // '" width="' // text(pixels(1)) // '" height="' // text(pixels(2)) &
      & // '" role="img">' // newline // "<title>" // escaped(title // ": " // shown) // "</title>" // newline // style // newline &
      & // words_at([margin, line_height], title) // words_at([margin, 2 * line_height], shown))
    do k = 1, size(scenes)
      call all%append(words_at(cells(k)%caption, caption_of(scenes(k))))
      do view = 1, size(cells(k)%windows)
        associate (window => cells(k)%windows(view))
          if (window%view%name /= "") call all%append(words_at(window%corner - [0.0_dp, 4.0_dp], trim(window%view%name)))
          do i = 1, size(scenes(k)%lines)
            if (any(scenes(k)%lines(i)%view == [0, view])) call all%append(element(scenes(k), i, window, cells(k)%at))
          end do
        end associate
      end do
    end do
    call all%append("</svg>" // newline)
    svg = all%whole()
  end function animated_svg

  !> SVG element with words at a point of the picture (pixels).
  function words_at(point, words) result(element)
    real(dp), intent(in) :: point(2)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: element

    element = '<text x="' // text(nint(fine * point(1))) // '" y="' // text(nint(fine * point(2))) // '">' // escaped(words) &
      & // "</text>" // newline
  end function words_at

  !> SVG element of line number `i` in one view.
  pure function element(scene, i, window, at) result(words)
    type(scene_type), intent(in) :: scene
    integer, intent(in) :: i
    type(window_type), intent(in) :: window
    real(dp), intent(in) :: at(:, :, :)
    character(len=:), allocatable :: words, tag, moves
    real(dp) :: places(2, size(scene%lines(i)%points), size(at, 3))
    logical :: still
    integer :: j, k

    associate (line => scene%lines(i))
      do k = 1, size(at, 3)
        do j = 1, size(line%points)
          places(:, j, k) = projected(window, at(:, line%points(j), k))
        end do
      end do
      still = all(nint(fine * places) == spread(nint(fine * places(:, :, 1)), 3, size(at, 3)))
      tag = "polyline"
      select case (trim(line%kind))
      case (outline)
        tag = "polygon"
      case (pin, center, probe)
        tag = "circle"
      case default
      end select
      words = "<" // tag // ' class="' // trim(line%kind) // '"'
      if (line%colour /= "") words = words // ' style="stroke:#' // line%colour // '"'
      if (tag == "circle") then
        words = words // ' r="' // either("45", "60", line%kind == center) // '" cx="' // coordinates(places(1:1, 1, 1), "") &
          & // '" cy="' // coordinates(places(2:2, 1, 1), "") // '"'
        moves = animation("cx", coordinates(places(1, 1, :), ";"), scene%seconds) &
          & // animation("cy", coordinates(places(2, 1, :), ";"), scene%seconds)
      else
        words = words // ' points="' // coordinates([places(:, :, 1)], ",") // '"'
        moves = coordinates([places(:, :, 1)], ",")
        do k = 2, size(at, 3)
          moves = moves // ";" // coordinates([places(:, :, k)], ",")
        end do
        moves = animation("points", moves, scene%seconds)
      end if
    end associate
    words = words // either("/>", ">" // moves // "</" // tag // ">", still) // newline
  end function element

  !> SVG element that animates an attribute through `values` again and again, each time for as many `seconds`.
  pure function animation(attribute, values, seconds) result(words)
    character(len=*), intent(in) :: attribute, values
    real(dp), intent(in) :: seconds
    character(len=:), allocatable :: words

    words = '<animate attributeName="' // attribute // '" dur="' // concise(seconds, 3) // 's" repeatCount="indefinite" ' &
      & // 'values="' // values // '"/>'
  end function animation

  !> Coordinates in tenths of a pixel with a `separator`. Between the points of a line both separators of SVG are commas.
  pure function coordinates(pixels, separator) result(words)
    real(dp), intent(in) :: pixels(:)
    character(len=*), intent(in) :: separator
    character(len=:), allocatable :: words
    integer :: i

    words = ""
    do i = 1, size(pixels)
      if (i > 1) words = words // separator
      words = words // text(nint(fine * pixels(i)))
    end do
  end function coordinates

end module gestell_output_picture_animation
