!> Prints the verdict on the machine of an input file at another speed, and the force on the ground.
program verdict
  use gestell, only: dp, error_type, machine_type, response_type, solution_type
  implicit none (type, external)

  type(machine_type) :: machine
  type(solution_type) :: solution
  type(response_type) :: force
  type(error_type), allocatable :: error

  call machine%read("data/khang_four_bar.nml", error)
  if (.not. allocated(error)) call machine%set("drive.speed_rpm", 300.0_dp, error)
  if (.not. allocated(error)) call machine%solve(solution, error, "stability, response")
  if (.not. allocated(error)) call solution%response("f", force, error)
  if (allocated(error)) error stop error%message
  print "(2a, f9.4, a, es8.1, a)", trim(solution%verdict()), ", force on the ground", force%peak, " N, to", force%peak_error, " N"
end program verdict
