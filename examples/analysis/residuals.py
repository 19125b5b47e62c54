"""Print the residuals of a session's fit by standoff, and compare with a fit without one standoff."""

import sys

import workbench as wb


def main(folder: str, without_mm: float) -> None:
    """Print three tables.

    Args:
        folder: session folder.
        without_mm: standoff to leave out.
    """
    session = wb.open_session(folder)
    print(session.residuals.groupby("standoff_mm")[["u_px", "v_px"]].std())
    refit = wb.fit(session.captures_for_fit(without=[without_mm]), rig=session.rig)
    print(refit.parameters[["value", "sd"]])
    print(wb.compare(session.calibration, refit).differences)


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]))
