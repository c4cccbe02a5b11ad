!> Draws guides and sliders in the picture of the mechanism. Their positions are read from the columns of mechanism.csv.
module gestell_task_drawing_guides
  use gestell_base_kinds, only: dp
  use gestell_base_text, only: concise, newline, text
  use gestell_model_joints_guide, only: guide_type
  use gestell_model_linkage_diagram, only: diagram_type
  use gestell_task_drawing_elements, only: axes, columns_type, element, point_columns
  implicit none (type, external)
  private

  public :: body_functions, guides, sliders

contains

  !> Gnuplot functions that convert a vector with the components a and b in the axes of a body to the axes of the picture. The
  !> first axis of the body points from the joint in columns p and p + 1 to the joint in columns q and q + 1.
  pure function body_functions() result(lines)
    character(len=:), allocatable :: lines

    lines = "apart(p, q) = sqrt((column(q) - column(p))**2 + (column(q + 1) - column(p + 1))**2)" // newline &
      & // "ex(p, q) = (column(q) - column(p)) / apart(p, q)" // newline &
      & // "ey(p, q) = (column(q + 1) - column(p + 1)) / apart(p, q)" // newline &
      & // "bodyx(p, q, a, b) = a * ex(p, q) - b * ey(p, q)" // newline &
      & // "bodyy(p, q, a, b) = a * ey(p, q) + b * ex(p, q)" // newline
  end function body_functions

  !> Parts of the plot command that draw the guides. A guide is drawn slightly longer than the travel of its slider.
  pure function guides(diagram, columns, origin, extent) result(words)
    type(diagram_type), intent(in) :: diagram
    type(columns_type), intent(in) :: columns
    !> `origin`: origin of the mechanism in the frame's axes (m). `extent`: length of the picture (m), to which symbols are scaled
    real(dp), intent(in) :: origin(2), extent
    character(len=:), allocatable :: words
    real(dp) :: travel(2)
    integer :: i

    words = ""
    do i = 1, size(diagram%sliders)
      travel = diagram%sliders(i)%travel + [-0.05_dp, 0.05_dp] * extent
      associate (guide => diagram%sliders(i)%guide)
        words = words // element("::row::row", place_on(guide, columns, origin, travel(1)) // ":" &
          & // step_along(guide, columns, travel(2) - travel(1)), "vectors nohead lt 1 dt 1 lw 7 lc rgb '#B5BFC8' notitle")
      end associate
    end do
  end function guides

  !> Parts of the plot command that draw the sliders as blocks on their guides.
  pure function sliders(diagram, columns, extent) result(words)
    type(diagram_type), intent(in) :: diagram
    type(columns_type), intent(in) :: columns
    real(dp), intent(in) :: extent
    character(len=:), allocatable :: words
    real(dp) :: half(2)
    integer :: i

    words = ""
    do i = 1, size(diagram%sliders)
      associate (slider => diagram%sliders(i))
        half = 0.025_dp * extent * [cos(slider%guide%angle), sin(slider%guide%angle)]
        words = words // element("::row::row", "($" // text(columns%joints(1, slider%joint)) // " - " &
          & // component(slider%guide, columns, half, 1) // "):($" // text(columns%joints(2, slider%joint)) // " - " &
          & // component(slider%guide, columns, half, 2) // "):" // step_along(slider%guide, columns, 0.05_dp * extent), &
          & "vectors nohead lt 1 dt 1 lw 11 lc rgb '#444444' notitle")
      end associate
    end do
  end function sliders

  !> Gnuplot columns with the point of a guide at the distance `travel` (m) from the guide's origin.
  pure function place_on(guide, columns, origin, travel) result(words)
    type(guide_type), intent(in) :: guide
    type(columns_type), intent(in) :: columns
    real(dp), intent(in) :: origin(2), travel
    character(len=:), allocatable :: words
    real(dp) :: point(2)

    point = guide%point + travel * [cos(guide%angle), sin(guide%angle)]
    if (all(guide%carriers == 0)) then
      words = point_columns(origin + point)
    else
      words = "($" // text(columns%joints(1, guide%carriers(1))) // " + " // component(guide, columns, point, 1) &
        & // "):($" // text(columns%joints(2, guide%carriers(1))) // " + " // component(guide, columns, point, 2) // ")"
    end if
  end function place_on

  !> Gnuplot columns with the components of a displacement of length `way` (m) along a guide.
  pure function step_along(guide, columns, way) result(words)
    type(guide_type), intent(in) :: guide
    type(columns_type), intent(in) :: columns
    real(dp), intent(in) :: way
    character(len=:), allocatable :: words
    real(dp) :: along(2)

    along = way * [cos(guide%angle), sin(guide%angle)]
    words = "(" // component(guide, columns, along, 1) // "):(" // component(guide, columns, along, 2) // ")"
  end function step_along

  !> Gnuplot expression for component number `k` of a `vector` given in the axes of the guide's body: the frame, or the body whose
  !> joints carry the guide.
  pure function component(guide, columns, vector, k) result(words)
    type(guide_type), intent(in) :: guide
    type(columns_type), intent(in) :: columns
    real(dp), intent(in) :: vector(2)
    integer, intent(in) :: k
    character(len=:), allocatable :: words

    words = concise(vector(k), 7)
    if (any(guide%carriers /= 0)) words = "body" // axes(k) // "(" // text(columns%joints(1, guide%carriers(1))) // ", " &
      & // text(columns%joints(1, guide%carriers(2))) // ", " // concise(vector(1), 7) // ", " // concise(vector(2), 7) // ")"
  end function component

end module gestell_task_drawing_guides
