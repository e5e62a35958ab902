"""What runs beside a test: workers, clusters, crowds, browsers; kills and full disks."""
