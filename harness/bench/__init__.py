"""What the closed loop costs, and how close an aircraft tracks: measurements."""
