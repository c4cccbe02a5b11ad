!> A column of a sweep as its picture shows it.
module gestell_task_sweep_shown
  use gestell_base_words, only: word_length
  implicit none (type, external)
  private

  !> Kinds of columns. `growth`: ln |rho|, negative if stable. `states`: verdicts. `decades`: positive values on a logarithmic scale
  integer, parameter, public :: growth = 1, states = 2, decades = 3

  !> A column of sweep.csv and how it is drawn.
  type, public :: shown_type
    !> `name`: name of the quantity. `label`: label of its axis, with the unit
    character(len=word_length + 32) :: name = "", label = ""
    !> Kind of the column: `growth`, `states` or `decades`
    integer :: kind = decades
    !> Gnuplot expression for the value in a row, in the unit of the axis
    character(len=48) :: value = ""
    !> Number of the column with the verdict; 0 if there is none
    integer :: verdict = 0
  end type shown_type

end module gestell_task_sweep_shown
