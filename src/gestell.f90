!> The library's front door: a machine in the language of input files, or a system of your own; what is found, by names.
!> Numbers go in with the units of the input and come out in SI units; tables say the units of their columns. Nothing is
!> printed, no state is kept. `gestell_door_numerics` has all that stands behind it.
module gestell
  use gestell_base_error, only: error_type, failed_computation, impossible_mechanism, invalid_input, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_base_version, only: version
  use gestell_door_c_machine, only:
  use gestell_door_c_solution, only:
  use gestell_door_c_system, only:
  use gestell_door_c_tables, only:
  use gestell_door_machine, only: machine_type
  use gestell_door_numerics, only:
  use gestell_door_solution, only: response_type, solution_type
  use gestell_door_system, only: motion_type, solve_system
  use gestell_output_table, only: table_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  public
end module gestell
