!> Writes parts of the picture of a mechanism as gnuplot commands: lines from columns of its table, points and outlines.
module gestell_task_drawing_elements
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_model_linkage, only: linkage_type
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  public :: column_pair, element, link_colour, new_columns, original_link, outline_lines, pair, point_columns

  character, parameter, public :: axes(3) = ["x", "y", "z"]
  character(len=6), parameter :: colours(0:6) = [character(len=6) :: "555555", "D55E00", "0072B2", "009E73", "CC79A7", "E69F00", &
    & "56B4E9"]

  !> Indices of the table columns that contain positions: of joints, shape (axes, joints), and of the centres of mass of links,
  !> shape (axes, links)
  type, public :: columns_type
    integer, allocatable :: joints(:, :), links(:, :)
  contains
    procedure :: between
  end type columns_type

contains

  !> Finds the indices of the columns of `table` that contain positions along two or three `dimensions`.
  pure type(columns_type) function new_columns(table, linkage, dimensions) result(columns)
    type(table_type), intent(in) :: table
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: dimensions
    integer :: i, k

    columns%joints = reshape([((table%number_of("joint(" // linkage%joints(i)%name // ")." // axes(k)), k = 1, dimensions), &
      & i = 1, size(linkage%joints))], [dimensions, size(linkage%joints)])
    columns%links = reshape([((table%number_of("link(" // linkage%links(i)%name // ")." // axes(k)), k = 1, dimensions), &
      & i = 1, size(linkage%links))], [dimensions, size(linkage%links)])
  end function new_columns

  !> Two gnuplot columns, for example "4:5".
  pure function column_pair(numbers) result(words)
    integer, intent(in) :: numbers(2)
    character(len=:), allocatable :: words

    words = text(numbers(1)) // ":" // text(numbers(2))
  end function column_pair

  !> Gnuplot columns with the position of the first of two `joints`, and with the vector from it to the second one.
  pure function between(self, joints, view_axes) result(words)
    class(columns_type), intent(in) :: self
    integer, intent(in) :: joints(2), view_axes(2)
    character(len=:), allocatable :: words
    integer :: k

    words = column_pair(self%joints(view_axes, joints(1)))
    do k = 1, 2
      words = words // ":($" // text(self%joints(view_axes(k), joints(2))) // " - $" // text(self%joints(view_axes(k), joints(1))) &
        & // ")"
    end do
  end function between

  !> Part of a plot command that draws a line or a set of points from mechanism.csv. `every`: selection of the rows, in gnuplot's
  !> notation.
  pure function element(every, columns, style) result(words)
    character(len=*), intent(in) :: every, columns, style
    character(len=:), allocatable :: words

    words = ", \" // newline // "  'mechanism.csv' every " // every // " using " // columns // " with " // style
  end function element

  !> A fixed point as two gnuplot columns, for example "(0.1):(0.2)".
  pure function point_columns(point) result(words)
    real(dp), intent(in) :: point(2)
    character(len=:), allocatable :: words

    words = "(" // concise(point(1), 7) // "):(" // concise(point(2), 7) // ")"
  end function point_columns

  !> A point as two coordinates separated by a comma.
  pure function pair(point) result(word)
    real(dp), intent(in) :: point(2)
    character(len=:), allocatable :: word

    word = concise(point(1), 7) // "," // concise(point(2), 7)
  end function pair

  !> Gnuplot command that draws the frame's outline, a polygon with the corners `hull`, shape (2, corners).
  pure function outline_lines(hull) result(lines)
    real(dp), intent(in) :: hull(:, :)
    character(len=:), allocatable :: lines
    integer :: i

    lines = "set object 1 polygon from " // pair(hull(:, size(hull, 2)))
    do i = 1, size(hull, 2)
      lines = lines // " to " // pair(hull(:, i))
    end do
    lines = lines // " behind fillcolor rgb '#E9EDF0' fillstyle solid 1 border lc rgb '#8C9BAB'" // newline
  end function outline_lines

  !> Colour of link number `link` in all pictures; grey for a bar that does not belong to a link (0). A copy that was made by
  !> &repeat has the same colour as its original.
  pure character(len=6) function link_colour(linkage, link)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: link

    link_colour = colours(0)
    if (link > 0) link_colour = colours(1 + mod(original_link(linkage, link) - 1, 6))
  end function link_colour

  !> Number of the link from which this link was copied, or its own number if it is not a copy. The name of a copy ends with a dot
  !> and the name of the original.
  pure integer function original_link(linkage, link) result(original)
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: link

    associate (name => linkage%links(link)%name)
      do original = 1, link - 1
        if (linkage%links(original)%name == name(index(name, ".", back=.true.) + 1:)) return
      end do
    end associate
  end function original_link

end module gestell_task_drawing_elements
