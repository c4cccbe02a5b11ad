!> Public interface of the library: a machine described in the language of input files, or a linear periodic system of your own, and
!> its results by name. Input uses the units of the input file; results are in SI units, and each table states the units of its
!> columns. Nothing is printed, and no state is kept between calls. `gestell_api_numerics` exports the numerical procedures behind
!> this interface.
module gestell
  use gestell_base_error, only: error_type, failed_computation, impossible_mechanism, invalid_input, wrong_usage
  use gestell_base_kinds, only: dp
  use gestell_base_version, only: version
  use gestell_api_c_machine, only:
  use gestell_api_c_solution, only:
  use gestell_api_c_system, only:
  use gestell_api_c_tables, only:
  use gestell_api_machine, only: machine_type
  use gestell_api_numerics, only:
  use gestell_api_solution, only: response_type, solution_type
  use gestell_api_system, only: motion_type, solve_system
  use gestell_output_table, only: table_type
  use gestell_system_periodic, only: periodic_system
  use gestell_system_second_order, only: second_order_system
  implicit none (type, external)
  public
end module gestell
