!> What a parameter of a design is of a link.
module gestell_study_design_parts
  implicit none (type, external)
  private

  !> Its mass, a coordinate of its place, its moment of inertia; or something else.
  integer, parameter, public :: other_part = 0, mass_part = 1, place_parts(2) = [2, 3], inertia_part = 4

end module gestell_study_design_parts
