!> Writes gnuplot commands that draw scenes: as an animation, or as a still picture.
module gestell_output_picture_scene_script
  use gestell_base_growing_text, only: growing_text_type
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: newline, text
  use gestell_output_picture_layout, only: caption_of, cell_type, place, projected
  use gestell_output_picture_scene, only: bar, block, center, ground, guide, outline, pin, probe, scene_type
  use gestell_output_picture_script, only: quoted
  implicit none (type, external)
  private

  public :: write_animation, write_still

  !> Groups of lines, each drawn by one part of a plot command: filled outlines, mounts and guides, the mechanism, and single points
  integer, parameter :: outlines = 1, mounts = 2, bars = 3, symbols = 4

contains

  !> Writes gnuplot commands that draw the scenes at all instants, one after the other.
  subroutine write_animation(scenes, lines, pixels)
    type(scene_type), intent(in) :: scenes(:)
    character(len=:), allocatable, intent(out) :: lines
    !> Width and height of the picture
    integer, intent(out) :: pixels(2)
    type(growing_text_type) :: data
    type(cell_type) :: cells(size(scenes))
    integer :: k, instants

    call place(scenes, cells, pixels)
    instants = size(scenes(1)%degrees) - 1
    do k = 1, instants
      call data%append(blocks(scenes, cells, pixels(2), k))
    end do
    lines = data_lines(data%whole()) // settings(scenes, cells, pixels) // "do for [k = 0:" // text(instants - 1) // "] {" &
      & // newline // "  plot " // parts("4 * k", "'#E9EDF0'") // newline // "}" // newline
  end subroutine write_animation

  !> Writes gnuplot commands that draw the scenes at their first instant, over the outline of the frame at rest.
  subroutine write_still(scenes, lines, pixels)
    type(scene_type), intent(in) :: scenes(:)
    character(len=:), allocatable, intent(out) :: lines
    !> Width and height of the picture
    integer, intent(out) :: pixels(2)
    type(cell_type) :: cells(size(scenes)), rest(size(scenes))
    integer :: k

    call place(scenes, cells, pixels)
    rest = cells
    do k = 1, size(scenes)
      rest(k)%at(:, :, 1) = scenes(k)%positions(1, 0.0_dp)
    end do
    lines = data_lines(blocks(scenes, rest, pixels(2), 1) // blocks(scenes, cells, pixels(2), 1)) &
      & // settings(scenes, cells, pixels) // "plot " // parts("4", "'#E9EDF0'") // ", \" // newline &
      & // "  $scene index 0 using 1:2 with lines lt 1 dt (4,3) lw 1.5 lc rgb '#777777'" // newline
  end subroutine write_still

  !> Gnuplot commands that define the data block $scene.
  pure function data_lines(blocks) result(lines)
    character(len=*), intent(in) :: blocks
    character(len=:), allocatable :: lines

    ! with column headers, gnuplot would skip the first line of each block
    lines = "unset datafile columnheaders" // newline // "$scene << END" // newline // blocks // "END" // newline
  end function data_lines

  !> Gnuplot commands that set title, ranges and captions.
  pure function settings(scenes, cells, pixels) result(lines)
    type(scene_type), intent(in) :: scenes(:)
    type(cell_type), intent(in) :: cells(:)
    integer, intent(in) :: pixels(2)
    character(len=:), allocatable :: lines
    integer :: k, view

    lines = "set title heading noenhanced" // newline // "unset border; unset tics; unset key; unset grid" // newline &
      & // "set lmargin 0; set rmargin 0; set bmargin 0; set tmargin at screen 1" // newline // "set title offset 0,-3" // newline &
      & // "set xrange [0:" // text(pixels(1)) // "]; set yrange [0:" // text(pixels(2)) // "]" // newline
    do k = 1, size(cells)
      lines = lines // label(cells(k)%caption, caption_of(scenes(k)))
      do view = 1, size(cells(k)%windows)
        associate (window => cells(k)%windows(view))
          if (window%view%name /= "") lines = lines // label(window%corner - [0.0_dp, 4.0_dp], trim(window%view%name))
        end associate
      end do
    end do

  contains

    !> Gnuplot command that writes words at a point (pixels).
    pure function label(point, words) result(line)
      real(dp), intent(in) :: point(2)
      character(len=*), intent(in) :: words
      character(len=:), allocatable :: line

      line = "set label " // quoted(words) // " at " // text(nint(point(1))) // "," // text(pixels(2) - nint(point(2))) &
        & // " noenhanced font ',11'" // newline
    end function label

  end function settings

  !> Parts of a plot command that draw the scene whose first block has the index `first`. `body`: colour of the frame.
  pure function parts(first, body) result(words)
    character(len=*), intent(in) :: first, body
    character(len=:), allocatable :: words

    words = "$scene index (" // first // ") using 1:2 with filledcurves closed lc rgb " // body // ", \" // newline &
      & // "  '' index (" // first // " + 1) using 1:2:3 with lines lt 1 dt 1 lw 1 lc rgb variable, \" // newline &
      & // "  '' index (" // first // " + 2) using 1:2:3 with lines lt 1 dt 1 lw 3 lc rgb variable, \" // newline &
      & // "  '' index (" // first // " + 3) using 1:2:3 with points lt 1 pt 7 ps 0.6 lc rgb variable"
  end function parts

  !> Data for gnuplot: a block for each group of lines, with all scenes at one instant. `height`: height of the picture in pixels.
  pure function blocks(scenes, cells, height, instant) result(words)
    type(scene_type), intent(in) :: scenes(:)
    type(cell_type), intent(in) :: cells(:)
    integer, intent(in) :: height, instant
    character(len=:), allocatable :: words
    type(growing_text_type) :: data
    character(len=6) :: colour
    integer :: group, i, k, n, view, spot(2)

    do group = outlines, symbols
      do k = 1, size(scenes)
        do view = 1, size(cells(k)%windows)
          do i = 1, size(scenes(k)%lines)
            associate (line => scenes(k)%lines(i))
              if (all([0, view] /= line%view) .or. group_of(line%kind) /= group) cycle
              colour = line%colour
              if (colour == "") colour = colour_of(line%kind)
              do n = 1, size(line%points)
                spot = nint(projected(cells(k)%windows(view), cells(k)%at(:, line%points(n), instant)))
                call data%append(text(spot(1)) // "," // text(height - spot(2)) // ",0x" // colour // newline)
              end do
              call data%append(newline)
            end associate
          end do
        end do
      end do
      ! gnuplot skips a block without data
      call data%append("-9999,-9999,0" // newline // newline // newline)
    end do
    words = data%whole()
  end function blocks

  !> Group to which a kind of line belongs.
  pure integer function group_of(kind)
    character(len=*), intent(in) :: kind

    select case (trim(kind))
    case (outline)
      group_of = outlines
    case (pin, center, probe)
      group_of = symbols
    case (bar, block)
      group_of = bars
    case default
      group_of = mounts
    end select
  end function group_of

  !> Colour of a line that has none of its own.
  pure character(len=6) function colour_of(kind)
    character(len=*), intent(in) :: kind

    select case (trim(kind))
    case (ground, guide)
      colour_of = "8C9BAB"
    case (probe)
      colour_of = "CC0000"
    case default
      colour_of = "222222"
    end select
  end function colour_of

end module gestell_output_picture_scene_script
