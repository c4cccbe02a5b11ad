!> Contains the inputs of `gestell --new`. Written by share/new/write_texts.py from share/new/*.nml: change those files.
module gestell_run_starting_texts
implicit none (type, external)
private

character, parameter :: n = new_line("a")

!> Kinds of machines for which there is an input.
character(len=17), parameter, public :: kinds(*) = [character(len=17) :: &
  & "slider-crank", &
  & "four-bar", &
  & "six-bar", &
  & "cam", &
  & "inline-engine", &
  & "v-engine", &
  & "machine-on-mounts"]

public :: starting_text

character(len=*), parameter :: slider_crank = &
  & "! Slider-crank on mounts: compressor, pump or press" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file and compare the strokes with the drawing." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'Slider-crank', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Crank speed in 1/min, constant; negative if the crank turns clockwise." // n // &
  & "&drive speed_rpm = 1450 /" // n // &
  & "" // n // &
  & "! Joints: x and y from the crank's bearing O. The slider B is 200 mm (the rod) from the" // n // &
  & "! crank pin A, on a guide through (0, 0) at 90 deg from x; branch 1 is the farther point." // n // &
  & "&joint name='O', type='ground', position=0,0 /" // n // &
  & "&joint name='A', type='crank', pivot='O', radius=50 /" // n // &
  & "&joint name='B', type='RRP', ends='A', lengths=200, guide_point=0,0, guide_angle=90, branch=1 /" // n // &
  & "" // n // &
  & "! Moving bodies: mass, inertia about the centre of mass, and centre of mass: distance" // n // &
  & "! from joint `from` along the line to joint `to`, and perpendicular to it (to the left)." // n // &
  & "! The crank's counterweight shifts its centre of mass away from the pin." // n // &
  & "&link name='crank',  from='O', to='A', mass=4.0, inertia=0.006, center=-8,0 /" // n // &
  & "&link name='rod',    from='A', to='B', mass=0.6, inertia=0.003, center=65,0 /" // n // &
  & "&link name='piston', from='B', mass=0.5, inertia=0.0005 /" // n // &
  & "" // n // &
  & "! Everything that does not move relative to the frame, with the motor: mass, inertia," // n // &
  & "! and position of the bearing O from the centre of mass F of these parts." // n // &
  & "&frame mass=45, inertia=1.6, origin=0,50 /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping horizontally and vertically. Mounts" // n // &
  & "! that lie one behind the other in the drawing are one &support with their sum." // n // &
  & "&support position=-200,-250, stiffness=60,120, damping=150,250 /" // n // &
  & "&support position= 200,-250, stiffness=60,120, damping=150,250 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, limit of the rms velocity in mm/s (10 to 1000 Hz)." // n // &
  & "&probe name='bearing', position=0,50, limit_mm_s=100 /" // n

character(len=*), parameter :: four_bar = &
  & "! Four-bar linkage on mounts: shaker, sieve or wiper" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file and compare the ranges with the drawing." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'Four-bar linkage', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Crank speed in 1/min, constant; negative if the crank turns clockwise." // n // &
  & "&drive speed_rpm = 240 /" // n // &
  & "" // n // &
  & "! Joints: x and y from the crank's bearing A0. B joins the coupler (370 mm from A) and" // n // &
  & "! the rocker (160 mm from B0); seen from A toward B0 it is on the left (branch 1)." // n // &
  & "&joint name='A0', type='ground', position=0,0 /" // n // &
  & "&joint name='B0', type='ground', position=400,0 /" // n // &
  & "&joint name='A', type='crank', pivot='A0', radius=70 /" // n // &
  & "&joint name='B', type='RRR', ends='A','B0', lengths=370,160, branch=1 /" // n // &
  & "" // n // &
  & "! Moving bodies: mass, inertia about the centre of mass, and centre of mass: distance" // n // &
  & "! from joint `from` along the line to joint `to`, and perpendicular to it (to the left)." // n // &
  & "&link name='crank',   from='A0', to='A', mass=0.50, inertia=0.0035, center=30,0 /" // n // &
  & "&link name='coupler', from='A',  to='B', mass=0.60, inertia=0.0070, center=180,0 /" // n // &
  & "&link name='rocker',  from='B0', to='B', mass=0.25, inertia=0.0060, center=80,0 /" // n // &
  & "" // n // &
  & "! Everything that does not move relative to the frame, with the motor: mass, inertia," // n // &
  & "! and position of the bearing A0 from the centre of mass F of these parts." // n // &
  & "&frame mass=18, inertia=0.78, origin=-200,200 /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping horizontally and vertically. Mounts" // n // &
  & "! that lie one behind the other in the drawing are one &support with their sum." // n // &
  & "&support position=-300,-200, stiffness=40,80, damping=150,250 /" // n // &
  & "&support position= 300,-200, stiffness=40,80, damping=150,250 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, frequency band in Hz, limit of the rms velocity in mm/s." // n // &
  & "&probe name='rocker bearing', position=200,200, band_hz=2,1000, limit_mm_s=45 /" // n

character(len=*), parameter :: six_bar = &
  & "! Six-bar linkage (Watt) on mounts: packaging or textile" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file and compare the ranges with the drawing." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'Six-bar linkage', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Crank speed in 1/min, constant; negative if the crank turns clockwise." // n // &
  & "&drive speed_rpm = 150 /" // n // &
  & "" // n // &
  & "! Joints in the order in which compasses would find them, x and y from the bearing A0." // n // &
  & "! 'RRR' is the pin of two bars: `lengths` from the joints `ends`; seen from ends(1)" // n // &
  & "! toward ends(2) it is on the left with branch 1, on the right with -1. 'rigid' is a" // n // &
  & "! third point of a body: `offset` along and perpendicular to the line of joints `ends`." // n // &
  & "&joint name='A0', type='ground', position=0,0 /" // n // &
  & "&joint name='B0', type='ground', position=250,0 /" // n // &
  & "&joint name='A', type='crank', pivot='A0', radius=70 /" // n // &
  & "&joint name='B', type='RRR', ends='A','B0', lengths=220,200, branch=1 /" // n // &
  & "&joint name='C', type='rigid', ends='A','B', offset=110,100 /" // n // &
  & "&joint name='E', type='rigid', ends='B0','B', offset=200,-120 /" // n // &
  & "&joint name='D', type='RRR', ends='C','E', lengths=220,200, branch=1 /" // n // &
  & "" // n // &
  & "! Moving bodies: mass, inertia about the centre of mass, and centre of mass: distance" // n // &
  & "! from joint `from` along the line to joint `to`, and perpendicular to it (to the left)." // n // &
  & "&link name='crank',   from='A0', to='A', mass=0.9, inertia=0.0015, center=20,0 /" // n // &
  & "&link name='coupler', from='A',  to='B', mass=1.4, inertia=0.0110, center=110,33 /" // n // &
  & "&link name='rocker',  from='B0', to='B', mass=1.2, inertia=0.0080, center=120,-40 /" // n // &
  & "&link name='arm',     from='C',  to='D', mass=0.7, inertia=0.0030, center=110,0 /" // n // &
  & "&link name='fold',    from='E',  to='D', mass=1.0, inertia=0.0060, center=100,0 /" // n // &
  & "" // n // &
  & "! Everything that does not move relative to the frame, with the motor: mass, inertia," // n // &
  & "! and position of the bearing A0 from the centre of mass F of these parts." // n // &
  & "&frame mass=150, inertia=8, origin=-100,150 /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping horizontally and vertically. Mounts" // n // &
  & "! that lie one behind the other in the drawing are one &support with their sum." // n // &
  & "&support position=-300,-200, stiffness=55,100, damping=500,800 /" // n // &
  & "&support position= 300,-200, stiffness=55,100, damping=500,800 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, frequency band in Hz, limit of the rms velocity in mm/s." // n // &
  & "&probe name='rocker bearing', position=150,150, band_hz=2,1000, limit_mm_s=45 /" // n

character(len=*), parameter :: cam = &
  & "! Cam and follower on mounts: feeder or valve train" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file and compare the strokes with the drawing." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'Cam and follower', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Camshaft speed in 1/min, constant; negative if the shaft turns clockwise." // n // &
  & "&drive speed_rpm = 240 /" // n // &
  & "" // n // &
  & "! The cam is the body with the centre O and the mark A (any point of the disc, 40 mm" // n // &
  & "! from O). The follower R moves on a guide through (0, 60) at 90 deg from x. Its lift" // n // &
  & "! by segments of a turn: rise 20 mm in 120 deg, dwell 60, return 120, dwell 60. The" // n // &
  & "! turn begins when the mark A points along the guide." // n // &
  & "&joint name='O', type='ground', position=0,0 /" // n // &
  & "&joint name='A', type='crank', pivot='O', radius=40 /" // n // &
  & "&joint name='R', type='follower', cam='O','A', guide_point=0,60, guide_angle=90," // n // &
  & "       law='polynomial_4567','dwell','polynomial_4567','dwell'," // n // &
  & "       law_angle=120,60,120,60, law_lift=20,0 /" // n // &
  & "" // n // &
  & "! Moving bodies: mass, inertia about the centre of mass, and centre of mass: distance" // n // &
  & "! from joint `from` along the line to joint `to`, and perpendicular to it (to the left)." // n // &
  & "&link name='cam',      from='O', to='A', mass=6.0, inertia=0.012, center=2,0 /" // n // &
  & "&link name='follower', from='R', mass=2.5, inertia=0.004, center=0,40 /" // n // &
  & "" // n // &
  & "! Everything that does not move relative to the frame, with the motor: mass, inertia," // n // &
  & "! and position of the cam's centre O from the centre of mass F of these parts." // n // &
  & "&frame mass=80, inertia=3.5, origin=0,100 /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping horizontally and vertically. Mounts" // n // &
  & "! that lie one behind the other in the drawing are one &support with their sum." // n // &
  & "&support position=-250,-200, stiffness=80,150, damping=400,700 /" // n // &
  & "&support position= 250,-200, stiffness=80,150, damping=400,700 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, frequency band in Hz, limit of the rms velocity in mm/s." // n // &
  & "&probe name='camshaft bearing', position=0,100, band_hz=2,1000, limit_mm_s=18 /" // n

character(len=*), parameter :: inline_engine = &
  & "! Inline engine on mounts: four cylinders, four-stroke" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file and compare the strokes with the drawing." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'Inline engine', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Crank speed in 1/min, kept constant by the flywheel (inertia about the crankshaft):" // n // &
  & "! then only the mean driving torque acts on the engine block." // n // &
  & "&drive speed_rpm = 1500, held_by = 'flywheel', flywheel_inertia = 0.15 /" // n // &
  & "" // n // &
  & "! Cylinder one: crank pin A and piston pin B, x and y from the crankshaft O. Its phase" // n // &
  & "! of 90 deg puts the pin at the upper dead centre when the drive's angle is 0." // n // &
  & "&mechanism name='one', phase=90 /" // n // &
  & "&joint mechanism='one', name='O', type='ground', position=0,0 /" // n // &
  & "&joint mechanism='one', name='A', type='crank', pivot='O', radius=43 /" // n // &
  & "&joint mechanism='one', name='B', type='RRP', ends='A', lengths=145, guide_point=0,0," // n // &
  & "       guide_angle=90, branch=1 /" // n // &
  & "" // n // &
  & "! Its bodies: mass, inertia about the centre of mass, and centre of mass: distance from" // n // &
  & "! joint `from` along the line to joint `to`, and perpendicular to it (to the left)." // n // &
  & "&link name='throw',  from='O', to='A', mass=4.2,  inertia=0.014, center=1,0 /" // n // &
  & "&link name='rod',    from='A', to='B', mass=0.56, inertia=0.002, center=43,0 /" // n // &
  & "&link name='piston', from='B', mass=0.40, inertia=0.0003 /" // n // &
  & "" // n // &
  & "! Gas pressure above that of the air in bar (scale: 1e5 Pa), every 30 deg over two turns" // n // &
  & "! from the upper dead centre at which the cylinder fires; bore in mm. The gas pushes the" // n // &
  & "! piston against the guide's direction (180 deg)." // n // &
  & "&load name='gas', on='piston', joint='B', axes='guide', direction=180, bore=86, scale=1e5," // n // &
  & "      cycle=2, phase=-90, force_table=25.0,33.0,13.0,6.3,4.0,2.8,0.1,0.1,0.1,0.1,0.1,0.1," // n // &
  & "      0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.2,0.8,2.4,7.7 /" // n // &
  & "" // n // &
  & "! The other cylinders: phase of the pin, and the drive's angle from the firing of one to" // n // &
  & "! theirs. Firing order 1-3-4-2, every 180 deg." // n // &
  & "&repeat of='one', name='two',   phase=270, firing=540 /" // n // &
  & "&repeat of='one', name='three', phase=270, firing=180 /" // n // &
  & "&repeat of='one', name='four',  phase=90,  firing=360 /" // n // &
  & "" // n // &
  & "! Engine block without the moving parts above, with gearbox: mass, inertia, and position" // n // &
  & "! of the crankshaft O from the centre of mass F of these parts." // n // &
  & "&frame mass=150, inertia=6.0, origin=0,-80 /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping along their own axes, which are turned" // n // &
  & "! by `angle` from the horizontal. Mounts one behind the other are one &support." // n // &
  & "&support position=-250,-60, stiffness=120,240, damping=400,700, angle=20 /" // n // &
  & "&support position= 250,-60, stiffness=120,240, damping=400,700, angle=-20 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, limit of the rms velocity in mm/s (10 to 1000 Hz)." // n // &
  & "&probe name='cylinder head', position=0,250, limit_mm_s=45 /" // n

character(len=*), parameter :: v_engine = &
  & "! V-engine on mounts: two cylinders at 90 deg, in space" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file and compare the strokes with the drawing." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'V-engine', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Crank speed in 1/min, kept constant by the flywheel (inertia about the crankshaft):" // n // &
  & "! then only the mean driving torque acts on the engine block." // n // &
  & "&drive speed_rpm = 3600, held_by = 'flywheel', flywheel_inertia = 0.05 /" // n // &
  & "" // n // &
  & "! Right cylinder: its plane is 11 mm along the crankshaft (zeta) from O, its axis turned" // n // &
  & "! by -45 deg from eta. `phase` is the pin's angle from the turned x-axis at the start:" // n // &
  & "! for pins at one place on the shaft, phase + angle is equal for both cylinders." // n // &
  & "&mechanism name='right', origin=0,0,11, angle=-45, phase=45 /" // n // &
  & "&joint mechanism='right', name='O', type='ground', position=0,0 /" // n // &
  & "&joint mechanism='right', name='A', type='crank', pivot='O', radius=40 /" // n // &
  & "&joint mechanism='right', name='B', type='RRP', ends='A', lengths=140, guide_point=0,0," // n // &
  & "       guide_angle=90, branch=1 /" // n // &
  & "" // n // &
  & "! Bodies (half of the crankshaft for each cylinder): mass, three inertias about the" // n // &
  & "! centre of mass (along from-to, across, about the crankshaft's direction), and centre" // n // &
  & "! of mass along and perpendicular to from-to. The crank carries the counterweight." // n // &
  & "&link name='crank',  from='O', to='A', mass=3.60, inertia=0.006,0.006,0.009, center=-6.82,0 /" // n // &
  & "&link name='rod',    from='A', to='B', mass=0.44, inertia=1.5e-4,1.3e-3,1.4e-3, center=42,0 /" // n // &
  & "&link name='piston', from='B', mass=0.48, inertia=3e-4,2.5e-4,3e-4 /" // n // &
  & "" // n // &
  & "! Gas pressure above that of the air in bar (scale: 1e5 Pa), every 30 deg over two turns" // n // &
  & "! from the upper dead centre at which the cylinder fires; bore in mm. The gas pushes the" // n // &
  & "! piston against the guide's direction (180 deg)." // n // &
  & "&load name='gas', on='piston', joint='B', axes='guide', direction=180, bore=90, scale=1e5," // n // &
  & "      cycle=2, phase=-90, force_table=25.0,33.0,13.0,6.3,4.0,2.8,0.1,0.1,0.1,0.1,0.1,0.1," // n // &
  & "      0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.2,0.8,2.4,7.7 /" // n // &
  & "" // n // &
  & "! Left cylinder: a copy on the other side. It fires 450 deg of the drive after the right" // n // &
  & "! one, so the engine fires at intervals of 450 and 270 deg." // n // &
  & "&repeat of='right', name='left', origin=0,0,-11, angle=45, phase=-45, firing=450 /" // n // &
  & "" // n // &
  & "! Engine block without the moving parts above: mass, six elements of the inertia tensor" // n // &
  & "! about F (xi, eta, zeta, xi-eta, xi-zeta, eta-zeta), position of O from F, and the six" // n // &
  & "! degrees of freedom." // n // &
  & "&frame mass=58, inertia=1.9,1.6,1.7,0.05,-0.06,0.08, origin=20,-70,0," // n // &
  & "       dof='xi','eta','zeta','rot_xi','rot_eta','psi' /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping along three axes of their own, which" // n // &
  & "! are turned by `angle` about zeta." // n // &
  & "&support position= 220,-170, 160, stiffness=30,45,30, damping=150,250,150, angle=45 /" // n // &
  & "&support position=-220,-170, 160, stiffness=30,45,30, damping=150,250,150, angle=-45 /" // n // &
  & "&support position= 200,-170,-180, stiffness=30,45,30, damping=150,250,150, angle=45 /" // n // &
  & "&support position=-200,-170,-180, stiffness=30,45,30, damping=150,250,150, angle=-45 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, limit of the rms velocity in mm/s (10 to 1000 Hz)." // n // &
  & "&probe name='cylinder head', position=120,120,0, limit_mm_s=45 /" // n

character(len=*), parameter :: machine_on_mounts = &
  & "! Rigid machine with unbalance on mounts: fan, motor, pump" // n // &
  & "! Lengths mm, masses kg, inertias kg m^2, stiffness N/mm, damping N s/m, angles deg." // n // &
  & "! First run `gestell --check` on this file: it prints the force of the unbalance." // n // &
  & "! `gestell --help GROUP` describes all keys of a group." // n // &
  & "&case title = 'Machine on mounts', tasks = 'stability', 'response', 'forces' /" // n // &
  & "&units length = 'mm', stiffness = 'N/mm' /" // n // &
  & "" // n // &
  & "! Speed in 1/min, constant; negative if the rotor turns clockwise." // n // &
  & "&drive speed_rpm = 1480 /" // n // &
  & "" // n // &
  & "! The rotor's bearing O; A marks a direction that turns with the rotor (any radius)." // n // &
  & "&joint name='O', type='ground', position=0,0 /" // n // &
  & "&joint name='A', type='crank', pivot='O', radius=100 /" // n // &
  & "" // n // &
  & "! The rotor: mass, inertia, and distance of its centre of mass from the axis. Balance" // n // &
  & "! grade G 6.3 allows 6.3 mm/s divided by the angular speed: 6.3/155 = 0.0406 mm." // n // &
  & "&link name='rotor', from='O', to='A', mass=40, inertia=0.8, center=0.0406,0 /" // n // &
  & "" // n // &
  & "! The machine without the rotor: mass, inertia about its centre of mass F, and position" // n // &
  & "! of the bearing O from F." // n // &
  & "&frame mass=160, inertia=9, origin=0,120 /" // n // &
  & "" // n // &
  & "! Mounts: position from F, stiffness and damping horizontally and vertically. Mounts" // n // &
  & "! that lie one behind the other in the drawing are one &support with their sum." // n // &
  & "&support position=-350,-250, stiffness=150,250, damping=600,900 /" // n // &
  & "&support position= 350,-250, stiffness=150,250, damping=600,900 /" // n // &
  & "" // n // &
  & "! A vibration meter: position from F, limit of the rms velocity in mm/s (10 to 1000 Hz)." // n // &
  & "&probe name='bearing', position=0,120, limit_mm_s=2.8 /" // n

contains

!> Input for a machine of this kind, one of `kinds`.
pure function starting_text(kind) result(text)
  character(len=*), intent(in) :: kind
  character(len=:), allocatable :: text

  select case (kind)
  case ("slider-crank")
    text = slider_crank
  case ("four-bar")
    text = four_bar
  case ("six-bar")
    text = six_bar
  case ("cam")
    text = cam
  case ("inline-engine")
    text = inline_engine
  case ("v-engine")
    text = v_engine
  case ("machine-on-mounts")
    text = machine_on_mounts
  case default
    text = ""
  end select
end function starting_text

end module gestell_run_starting_texts
