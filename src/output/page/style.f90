!> Style sheet of a page, and the script of its buttons.
module gestell_output_page_style
  use gestell_output_page_colours, only: colour_rules
  use gestell_output_page_lines, only: joined
  implicit none (type, external)
  private

  public :: button_script, style_sheet

  !> Rules of the style sheet, without the colours
  character(len=*), parameter :: rules(*) = [character(len=124) :: &
    & "body{font:16px/1.5 system-ui,sans-serif;color:var(--g2);background:var(--gf);max-width:62rem;margin:2rem auto;", &
    & "padding:0 1rem;overflow-wrap:break-word}", &
    & "h1{line-height:1.2;margin-bottom:.2rem}", &
    & "h2{margin-top:2.5rem;border-bottom:1px solid var(--gc)}", &
    & "h3{margin:.5rem 0}", &
    & "a{color:var(--c1)}", &
    & ":focus-visible{outline:3px solid var(--c1);outline-offset:2px}", &
    & ".skip{position:absolute;left:-99rem}", &
    & ".skip:focus{left:1rem;top:.5rem;background:var(--gf);padding:.5rem}", &
    & ".sub,figcaption,caption,summary,dt{color:var(--g5);font-size:.9rem}", &
    & ".sub{margin-top:0}", &
    & ".verdict,.warnings li{padding:.8rem 1rem;border-left:.5rem solid var(--g8);background:var(--ge);margin:.5rem 0}", &
    & ".verdict{font-size:1.1rem}", &
    & ".warnings{list-style:none;padding:0}", &
    & ".verdict.stable,.warnings .stable{border-color:var(--c3)}", &
    & ".verdict.unstable,.warnings .unstable{border-color:var(--c2)}", &
    & ".verdict:is(.undecided,.undamped),.warnings :is(.undecided,.undamped){border-color:var(--c5)}", &
    & "nav ol{columns:14rem;padding-left:1.5rem}", &
    & "summary{cursor:pointer}", &
    & ".cards{display:flex;flex-wrap:wrap;gap:1rem 3rem}", &
    & ".cards>div{min-width:0;max-width:100%}", &
    & "dl{display:flex;flex-wrap:wrap;gap:.5rem 2.5rem;margin:1rem 0}", &
    & "dd{margin:0;font-size:1.3rem}", &
    & "figure{margin:1rem 0}", &
    & ".plot{display:block;width:100%;max-width:var(--w);height:auto;", &
    & "fill:none;stroke:currentColor;stroke-width:1;color:var(--g0);", &
    & "font:14px sans-serif}", &
    & ".plot text{stroke:none}", &
    & ".plot [text-anchor]:not([fill]){fill:var(--g0)}", &
    & "/* Shadows at the edges show where a region scrolls. */", &
    & ".wide{overflow-x:auto;max-width:100%;background:linear-gradient(90deg,var(--gf) 30%,transparent),", &
    & "linear-gradient(270deg,var(--gf) 30%,transparent) 100% 0,", &
    & "radial-gradient(farthest-side at 0 50%,var(--g9),transparent),", &
    & "radial-gradient(farthest-side at 100% 50%,var(--g9),transparent) 100% 0;background-repeat:no-repeat;", &
    & "background-size:40px 100%,40px 100%,14px 100%,14px 100%;background-attachment:local,local,scroll,scroll}", &
    & "table{border-collapse:collapse;font-size:.9rem;margin:.5rem 0}", &
    & "caption{text-align:left}", &
    & "th,td{padding:.15rem .6rem;border-bottom:1px solid var(--gd);text-align:left}", &
    & "tbody th{vertical-align:top}", &
    & "thead th{border-bottom:2px solid var(--g8);vertical-align:bottom}", &
    & ".n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}", &
    & ".js .x,html:not(.js) .all{display:none}", &
    & ".js .every .x{display:table-cell}", &
    & ".js .every tr.x{display:table-row}", &
    & "button{font:inherit;font-size:.9rem;color:inherit;background:var(--ge);border:1px solid var(--g8);border-radius:.3rem;", &
    & "padding:.3rem .8rem;cursor:pointer}", &
    & "[aria-pressed=true]{background:var(--gb)}", &
    & "pre{background:var(--ge);padding:1rem;overflow-x:auto;font-size:.8rem;line-height:1.35}", &
    & ".views{display:flex;flex-wrap:wrap;gap:0 1rem}", &
    & ".views figure{min-width:0;max-width:100%;margin:0}", &
    & ".views svg{display:block;width:100%;height:auto;fill:none;stroke-width:1.5;stroke-linejoin:round;stroke-linecap:round}", &
    & ".views .frame{fill-opacity:.15}", &
    & ".views .bar{stroke-width:4}", &
    & ".views .slider{stroke-width:8;stroke-linecap:butt}", &
    & ".views .guide{stroke-width:1}", &
    & ".views .pin{fill:var(--gf)}", &
    & ".controls,.controls label{display:flex;flex-wrap:wrap;align-items:center;gap:.5rem 1.5rem}", &
    & ".controls label{gap:0 .5rem}", &
    & ".controls input{width:10rem;height:1.5rem;accent-color:var(--c1)}", &
    & "output{min-width:5rem;font-variant-numeric:tabular-nums}", &
    & ".play{min-width:5rem}", &
    & "[hidden]{display:none!important}", &
    & "@media screen and (max-width:40rem){", &
    & "body{margin:1rem auto;font-size:15px}", &
    & "h1{font-size:1.6rem}", &
    & "h2{margin-top:1.5rem}", &
    & "/* Usual pictures fit the screen; a tap, which focuses a picture, enlarges it. */", &
    & ".wide .plot{min-width:calc(.555*var(--w))}", &
    & ".wide:focus .plot{min-width:min(640px,var(--w))}", &
    & ".wide+figcaption::after{content:' Tap the picture to enlarge it.'}", &
    & ".wide:focus+figcaption::after{content:' Scroll sideways to see the whole picture.'}", &
    & ".verdict,.warnings li{padding:.5rem;font-size:1rem}", &
    & "th,td{padding:.15rem .4rem}", &
    & "pre{padding:.5rem;font-size:.7rem}", &
    & "}", &
    & "@page{size:A4;margin:15mm}", &
    & "@media print{", &
    & "body{margin:0;max-width:none;font-size:10pt;padding:0}", &
    & "h2,h3{break-after:avoid}", &
    & "figure,tr,.verdict,.controls{break-inside:avoid}", &
    & ".plot{max-height:22cm}", &
    & "pre{white-space:pre-wrap}", &
    & ".wide{overflow:visible;background:none}", &
    & "table{font-size:8pt}", &
    & "th,td{padding:.1rem .3rem}", &
    & ".verdict,.warnings li{padding:.2rem .6rem;margin:.2rem 0}", &
    & ".n{white-space:normal}", &
    & "nav,.skip,.all,.play,.controls input{display:none}", &
    & ".views{max-width:12cm}", &
    & "}"]

  !> JavaScript of the buttons that show all columns of a table
  character(len=*), parameter :: script(*) = [character(len=124) :: &
    & "<script>", &
    & "document.documentElement.className = 'js';", &
    & "for (const button of document.querySelectorAll('button.all')) button.onclick = () => {", &
    & "  const every = button.nextElementSibling.classList.toggle('every');", &
    & "  button.setAttribute('aria-pressed', every);", &
    & "};", &
    & "</script>"]

contains

  !> Style sheet of a page.
  pure function style_sheet() result(sheet)
    character(len=:), allocatable :: sheet

    sheet = colour_rules() // joined(rules)
  end function style_sheet

  !> Element <script> that runs the buttons above it.
  pure function button_script() result(words)
    character(len=:), allocatable :: words

    words = joined(script)
  end function button_script

end module gestell_output_page_style
