!> Elements of the mechanism's picture: lines from columns of its table, points and outlines in gnuplot's notation.
module gestell_task_drawing_elements
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_model_linkage, only: linkage_type
  use gestell_output_table, only: table_type
  implicit none (type, external)
  private

  public :: element, new_columns, outline_lines, pair, point_columns

  character, parameter, public :: axes(3) = ["x", "y", "z"]

  !> Column numbers in the table: positions of joints, shape (axes, joints), and of links' centres of mass, shape (axes, links)
  type, public :: columns_type
    integer, allocatable :: joints(:, :), links(:, :)
  contains
    procedure :: joint, link, between
  end type columns_type

contains

  !> Column numbers of a `table` with positions in two or three `dimensions`.
  pure type(columns_type) function new_columns(table, linkage, dimensions) result(columns)
    type(table_type), intent(in) :: table
    class(linkage_type), intent(in) :: linkage
    integer, intent(in) :: dimensions
    integer :: i, k

    allocate(columns%joints(dimensions, size(linkage%joints)), columns%links(dimensions, size(linkage%links)))
    do k = 1, dimensions
      do i = 1, size(linkage%joints)
        columns%joints(k, i) = table%number_of("joint(" // linkage%joints(i)%name // ")." // axes(k))
      end do
      do i = 1, size(linkage%links)
        columns%links(k, i) = table%number_of("link(" // linkage%links(i)%name // ")." // axes(k))
      end do
    end do
  end function new_columns

  !> Columns of the position of joint `i` along the two axes `seen`, for example "4:5".
  pure function joint(self, i, seen) result(words)
    class(columns_type), intent(in) :: self
    integer, intent(in) :: i, seen(2)
    character(len=:), allocatable :: words

    words = text(self%joints(seen(1), i)) // ":" // text(self%joints(seen(2), i))
  end function joint

  !> Columns of the centre of mass of link `i` along the two axes `seen`.
  pure function link(self, i, seen) result(words)
    class(columns_type), intent(in) :: self
    integer, intent(in) :: i, seen(2)
    character(len=:), allocatable :: words

    words = text(self%links(seen(1), i)) // ":" // text(self%links(seen(2), i))
  end function link

  !> Columns of the position of one joint and of the vector to another joint.
  pure function between(self, joints, seen) result(words)
    class(columns_type), intent(in) :: self
    integer, intent(in) :: joints(2), seen(2)
    character(len=:), allocatable :: words
    integer :: k

    words = self%joint(joints(1), seen)
    do k = 1, 2
      words = words // ":($" // text(self%joints(seen(k), joints(2))) // " - $" // text(self%joints(seen(k), joints(1))) // ")"
    end do
  end function between

  !> Plot element of one line from the rows `every` of mechanism.csv.
  pure function element(every, columns, style) result(words)
    character(len=*), intent(in) :: every, columns, style
    character(len=:), allocatable :: words

    words = ", \" // newline // "  'mechanism.csv' every " // every // " using " // columns // " with " // style
  end function element

  !> A point in place of two columns.
  pure function point_columns(point) result(words)
    real(dp), intent(in) :: point(2)
    character(len=:), allocatable :: words

    words = "(" // concise(point(1), 7) // "):(" // concise(point(2), 7) // ")"
  end function point_columns

  !> A point as a pair of coordinates separated by a comma.
  pure function pair(point) result(word)
    real(dp), intent(in) :: point(2)
    character(len=:), allocatable :: word

    word = concise(point(1), 7) // "," // concise(point(2), 7)
  end function pair

  !> Gnuplot line for the frame's outline, a polygon with the corners `hull`, shape (2, corners).
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

end module gestell_task_drawing_elements
