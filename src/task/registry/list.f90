!> Lists all tasks in the order in which they run and appear in the report. To add a task, add one `use` and one line to this file.
submodule (gestell_task_registry) gestell_task_registry_list
use gestell_task_balance, only: balance_task
use gestell_task_boundary_task, only: boundary_task
use gestell_task_campbell_task, only: campbell_task
use gestell_task_critical_task, only: critical_task
use gestell_task_design_task, only: design_task
use gestell_task_drawing, only: drawing_task
use gestell_task_forces, only: forces_task
use gestell_task_joints, only: joints_task
use gestell_task_matrices, only: matrices_task
use gestell_task_modes, only: modes_task
use gestell_task_power, only: power_task
use gestell_task_probes, only: probes_task
use gestell_task_quantities, only: quantities_task
use gestell_task_resonance_task, only: resonance_task
use gestell_task_response, only: response_task
use gestell_task_sensitivity_task, only: sensitivity_task
use gestell_task_separation_task, only: separation_task
use gestell_task_stability, only: stability_task
use gestell_task_sweep_task, only: sweep_task
use gestell_task_trade_task, only: trade_task
implicit none (type, external)

!> Maximum number of tasks in the list
integer, parameter :: most = 50

contains

module subroutine all_tasks(tasks)
  type(any_task_type), allocatable, intent(out) :: tasks(:)
  integer :: n

  allocate(tasks(most))
  n = 0
  call add(drawing_task())
  call add(stability_task())
  call add(modes_task())
  call add(matrices_task())
  call add(response_task())
  call add(forces_task())
  call add(joints_task())
  call add(probes_task())
  call add(power_task())
  call add(quantities_task())
  call add(trade_task())
  call add(balance_task())
  call add(sensitivity_task())
  call add(separation_task())
  call add(design_task())
  call add(sweep_task())
  call add(boundary_task())
  call add(campbell_task())
  call add(critical_task())
  call add(resonance_task())
  tasks = tasks(:n)

contains

  subroutine add(task)
    class(task_type), intent(in) :: task

    n = n + 1
    allocate(tasks(n)%task, source=task)
    call tasks(n)%task%describe()
  end subroutine add

end subroutine all_tasks

end submodule gestell_task_registry_list
